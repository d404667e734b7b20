// POGEMA configs as YAML. The page reads only the fields that it edits, and keeps all other lines unchanged.

const EDITED = ["map", "agents_xy", "targets_xy", "num_agents"];

// Splits a config into blocks: a top-level field with its lines, or other lines, such as comments.
function splitConfig(text) {
  const blocks = [];
  const seen = new Map();
  text.replace(/^\uFEFF/, "").replace(/\r\n?/g, "\n").replace(/\n$/, "").split("\n").forEach((line, index) => {
    const field = /^(?:([A-Za-z_]\w*)|"([^"]*)"|'([^']*)')\s*:(?=\s|$)/.exec(line);
    if (field) {
      const name = field[1] ?? field[2] ?? field[3];
      if (seen.has(name)) throw new ParseError(index + 1, 1, `duplicate key "${name}"`);
      seen.set(name, true);
      blocks.push({ name, line: index + 1, column: field[0].length + 1, lines: [line] });
    } else if (/^(#|---|%|\.\.\.)/.test(line) || blocks.length === 0) {
      if (/^\S/.test(line) && !/^(#|---|%|\.\.\.)/.test(line)) {
        throw new ParseError(index + 1, 1, "expected a field such as map: or a comment");
      }
      blocks.push({ name: null, line: index + 1, lines: [line] });
    } else if (/^[^\s\-\]}]/.test(line)) {
      throw new ParseError(index + 1, 1, "expected a field such as map: or a comment");
    } else {
      blocks.at(-1).lines.push(line);
    }
  });
  return blocks;
}

// Returns [line, column] of a JSON error. The wording of its message depends on the browser.
function positionInJson(text, message) {
  const found = /line (\d+) column (\d+)/.exec(message);
  if (found) return [Number(found[1]), Number(found[2])];
  const lines = text.slice(0, Number(/position (\d+)/.exec(message)?.[1] ?? 0)).split("\n");
  return [lines.length, lines.at(-1).length + 1];
}

// Splits a JSON config into blocks. Its other fields become lines of YAML, in which JSON values are valid.
function blocksOfJson(text) {
  let [object, tooLong] = [null, null];
  // JavaScript numbers are exact up to 2⁵³, but seeds go up to 2⁶³.
  const findTooLong = (name, value) => {
    if (Number.isInteger(value) && !Number.isSafeInteger(value)) tooLong = name;
    return value;
  };
  try {
    object = JSON.parse(text, findTooLong);
  } catch (error) {
    throw new ParseError(...positionInJson(text, error.message), "invalid JSON, expected a config in braces to be JSON");
  }
  if (tooLong !== null) {
    throw new ParseError(1, 1, `${tooLong} has too many digits to be read exactly from JSON, expected a config in YAML`);
  }
  return Object.entries(object).map(([name, value]) => {
    const isText = name === "map" && typeof value === "string";
    const lines = isText ? ["map: |-", ...value.split(/\s+/).filter(Boolean).map((row) => `  ${row}`)] : null;
    return { name, line: 1, column: name.length + 2, lines: lines ?? [`${name}: ${JSON.stringify(value)}`] };
  });
}

function parseConfig(text) {
  const blocks = /^\s*\{/.test(text) ? blocksOfJson(text) : splitConfig(text);
  const find = (name) => blocks.find((block) => block.name === name && !isNull(block));
  const mapBlock = find("map");
  if (!mapBlock) throw new ParseError(1, 1, "the config has no map, expected the field map");
  const map = parseMapBlock(mapBlock);
  const [startsBlock, goalsBlock] = [find("agents_xy"), find("targets_xy")];
  if (map.agents.length > 0 && startsBlock && goalsBlock) {
    const reason = "the map has starts and goals too, expected them in the map or in agents_xy and targets_xy";
    throw new ParseError(startsBlock.line, 1, reason);
  }
  // If the map has letters, POGEMA ignores a single list.
  if (map.agents.length > 0) return { ...map, blocks };
  if (Boolean(startsBlock) !== Boolean(goalsBlock)) {
    const [given, missing] = startsBlock ? [startsBlock, "targets_xy"] : [goalsBlock, "agents_xy"];
    throw new ParseError(given.line, 1, `found ${given.name} without ${missing}, expected both`);
  }
  const agents = startsBlock ? pairLists(map, startsBlock, goalsBlock) : [];
  return { ...map, agents, blocks, numListed: agents.length };
}

const valueOf = (block) => block.lines[0].slice(block.column - 1).trim();
const isNull = (block) => block.lines.length === 1 && /^(null|~|)\s*(#.*)?$/.test(valueOf(block));

function parseMapBlock(block) {
  const value = valueOf(block);
  if (/^[|>][-+0-9]*\s*(\s#.*)?$/.test(value)) {
    return parseMapText(block.lines.slice(1).join("\n"), block.line + 1, 1);
  }
  const text = plainText(value);
  const column = block.column + block.lines[0].slice(block.column - 1).indexOf(value);
  if (text !== null) return parseQuotedMap(value, text, block.line, column);
  if (/^[^[\s#&*!|>%@`{]/.test(value)) {
    // Blank the name of the field, so that columns are those of the file.
    const blank = " ".repeat(block.column - 1) + block.lines[0].slice(block.column - 1);
    return parseMapText([blank, ...block.lines.slice(1)].join("\n"), block.line, 1);
  }
  const rows = parseList(block, "a block after `map: |-`, or a list of rows of 0 and 1");
  const isRow = (row) => Array.isArray(row) && row.length === rows[0].length && row.every((cell) => cell === 0 || cell === 1);
  const bad = rows.findIndex((row) => !isRow(row));
  if (rows.length === 0 || bad >= 0 || rows[0].length === 0) {
    throw new ParseError(block.line, block.column + 1, `row ${Math.max(bad, 0)} of the map is invalid, expected 0 and 1, as many as in the first row`);
  }
  return { height: rows.length, width: rows[0].length, cells: Uint8Array.from(rows.flat()), agents: [] };
}

// Parses the map text between quotes. Escapes shift its characters, so an error then has the position of the value.
function parseQuotedMap(value, text, line, column) {
  try {
    return parseMapText(text, line, column + 1);
  } catch (error) {
    if (!(error instanceof ParseError) || text === value.slice(1, -1)) throw error;
    throw new ParseError(line, column, error.reason);
  }
}

// Returns the text between quotes on one line, or null.
function plainText(value) {
  if (/^'[^']*'$/.test(value)) return value.slice(1, -1);
  if (!/^".*"$/.test(value)) return null;
  try {
    return JSON.parse(value);
  } catch {
    return null;
  }
}

// Parses a list in brackets, or a list with a dash before each item in brackets; ignores comments.
function parseList(block, expected) {
  const lines = [valueOf(block), ...block.lines.slice(1)].map((line) => line.replace(/(^|\s)#.*$/, ""));
  const items = lines.slice(1).filter((line) => line.trim() !== "");
  const isDashed = lines[0] === "" && items.every((line) => /^\s*-\s/.test(line));
  try {
    const text = isDashed ? `[${items.map((line) => line.replace(/^\s*-\s+/, "")).join(",")}]` : lines.join(" ");
    const list = JSON.parse(text.replace(/,\s*\]/g, "]"));
    if (Array.isArray(list)) return list;
  } catch {
    // Reported below, with its position.
  }
  throw new ParseError(block.line, block.column + 1, `${block.name} cannot be read, expected ${expected}`);
}

function pairLists(map, startsBlock, goalsBlock) {
  const isCell = (cell) => Array.isArray(cell) && cell.length === 2 && cell.every((at) => Number.isInteger(at) && at >= 0);
  const check = (block, cell) => {
    if (!isCell(cell)) {
      const reason = `${block.name} has ${JSON.stringify(cell)}, expected [row, col]`;
      throw new ParseError(block.line, block.column + 1, reason);
    }
    if (cell[0] < map.height && cell[1] < map.width) return cell;
    const counted = (number, noun) => `${number} ${noun}${number === 1 ? "" : "s"}`;
    const size = `${counted(map.height, "row")} and ${counted(map.width, "column")}`;
    const reason = `${block.name} has ${place(cell)}, which is outside the map of ${size}`;
    throw new ParseError(block.line, block.column + 1, reason);
  };
  const starts = parseList(startsBlock, "a list of [row, col]").map((cell) => check(startsBlock, cell));
  const goals = parseList(goalsBlock, "a list of [row, col]");
  if (starts.length !== goals.length) {
    const reason = `agents_xy has ${starts.length} cells and targets_xy has ${goals.length}, expected equal numbers`;
    throw new ParseError(goalsBlock.line, goalsBlock.column + 1, reason);
  }
  return starts.map((start, agent) => {
    const isSequence = Array.isArray(goals[agent]?.[0]);
    const [goal, ...more] = (isSequence ? goals[agent] : [goals[agent]]).map((cell) => check(goalsBlock, cell));
    return { start, goal, more };
  });
}

const listOf = (cells) => `[${cells.map(([row, col]) => `[${row}, ${col}]`).join(", ")}]`;

// Returns the lines of an edited field, possibly none.
function linesOf(name, map, hadCount) {
  const { agents } = map;
  if (name === "map") return ["map: |-", ...rowsOf(map).map((row) => `  ${row.join("")}`)];
  if (agents.length === 0) return [];
  if (name === "num_agents") return hadCount ? [`num_agents: ${agents.length}`] : [];
  if (name === "agents_xy") return [`agents_xy: ${listOf(agents.map((agent) => agent.start))}`];
  const isSequence = agents.some((agent) => agent.more.length > 0);
  const goals = agents.map(({ goal, more }) => (isSequence ? listOf([goal, ...more]) : `[${goal.join(", ")}]`));
  return [`targets_xy: [${goals.join(", ")}]`];
}

function formatConfig(map, blocks) {
  const written = new Set();
  const lines = blocks.flatMap((block) => {
    if (!EDITED.includes(block.name)) return block.lines;
    written.add(block.name);
    // Keep num_agents if the page has not changed the number of agents: without listed agents, POGEMA places that many;
    // otherwise it takes that many from a longer list.
    const isUntouched = map.agents.length === 0 || map.agents.length === map.numListed;
    if (block.name === "num_agents" && isUntouched) return block.lines;
    return linesOf(block.name, map, true);
  });
  for (const name of EDITED) if (!written.has(name)) lines.push(...linesOf(name, map, false));
  return `${lines.join("\n")}\n`;
}
