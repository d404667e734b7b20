// POGEMA configs as YAML. The page edits only the fields below. It keeps all other lines, but removes the indentation
// of comments after the map.

const EDITED = ["map", "agents_xy", "targets_xy", "num_agents"];

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
  // If the map has letters and only one of the two lists is given, POGEMA ignores that list.
  if (map.agents.length > 0) return { ...map, blocks };
  if (Boolean(startsBlock) !== Boolean(goalsBlock)) {
    const [given, missing] = startsBlock ? [startsBlock, "targets_xy"] : [goalsBlock, "agents_xy"];
    throw new ParseError(given.line, 1, `found ${given.name} without ${missing}, expected both`);
  }
  const agents = startsBlock ? pairLists(map, startsBlock, goalsBlock) : [];
  return { ...map, agents, blocks, numListed: agents.length };
}

function parseMapBlock(block) {
  const value = valueOf(block);
  if (/^[|>]/.test(value)) return parseMapText(block.lines.slice(1).join("\n"), block.line + 1, 1);
  if (/^["']/.test(value)) return parseQuotedMap(block);
  if (/^[^[\s#&*!%@`{]/.test(value)) {
    // Blank the name of the field, so that columns are those of the file.
    const blank = " ".repeat(block.column - 1) + block.lines[0].slice(block.column - 1);
    return parseMapText([blank, ...block.lines.slice(1)].map(withoutComment).join("\n"), block.line, 1);
  }
  const rows = parseList(block, MAP_NOTATIONS);
  if (rows.length === 0) {
    throw new ParseError(block.line, block.column + 1, "the map has no cell, expected a list of rows of 0 and 1");
  }
  const isRow = (row) => Array.isArray(row) && row.length === rows[0].length && row.every((cell) => cell === 0 || cell === 1);
  const bad = rows.findIndex((row) => !isRow(row));
  if (bad >= 0 || rows[0].length === 0) {
    const reason = `row ${Math.max(bad, 0)} of the map is invalid, expected a list of 0 and 1 as long as the first row`;
    throw new ParseError(block.line, block.column + 1, reason);
  }
  return { height: rows.length, width: rows[0].length, cells: Uint8Array.from(rows.flat()), agents: [] };
}

// Parses map text in quotes. Escapes and line breaks shift its characters, so an error then has the position of the
// value.
function parseQuotedMap(block) {
  const column = block.column + block.lines[0].slice(block.column - 1).search(/\S/);
  const value = [valueOf(block), ...block.lines.slice(1)].join(" ");
  const [quoted] = /^"(?:[^"\\]|\\.)*"|^'(?:[^']|'')*'/.exec(value) ?? [value];
  let text = quoted.slice(1, -1);
  try {
    if (quoted[0] === '"') text = JSON.parse(quoted);
  } catch {
    throw unreadable(block, MAP_NOTATIONS);
  }
  try {
    return parseMapText(text, block.line, column + 1);
  } catch (error) {
    if (!(error instanceof ParseError) || (block.lines.length === 1 && text === quoted.slice(1, -1))) throw error;
    throw new ParseError(block.line, column, error.reason);
  }
}

const MAP_NOTATIONS = "a block after `map: |-`, text in quotes, or a list of rows of 0 and 1";

const unreadable = (block, expected) =>
  new ParseError(block.line, block.column + 1, `${block.name} cannot be read, expected ${expected}`);

// Parses a list in brackets, or a list with a dash before each item in brackets; ignores comments.
function parseList(block, expected) {
  const lines = [valueOf(block), ...block.lines.slice(1)].map(withoutComment);
  const items = lines.slice(1).filter((line) => line.trim() !== "");
  const isDashed = lines[0] === "" && items.every((line) => /^\s*-\s/.test(line));
  const text = isDashed ? `[${items.map((line) => line.replace(/^\s*-\s+/, "")).join(",")}]` : lines.join(" ");
  const fraction = /-?\d+(\.\d*|[eE])[-+\d.eE]*/.exec(text);
  if (fraction) {
    throw new ParseError(block.line, block.column + 1, `${block.name} has ${fraction[0]}, expected whole numbers`);
  }
  try {
    const list = JSON.parse(text.replace(/,\s*\]/g, "]"));
    if (Array.isArray(list)) return list;
  } catch {
    // Reported below, with its position.
  }
  throw unreadable(block, expected);
}

function pairLists(map, startsBlock, goalsBlock) {
  const isCell = (cell) => Array.isArray(cell) && cell.length === 2 && cell.every((at) => Number.isInteger(at) && at >= 0);
  const check = (block, cell) => {
    if (!isCell(cell)) {
      const reason = `${block.name} has ${JSON.stringify(cell)}, expected [row, col]`;
      throw new ParseError(block.line, block.column + 1, reason);
    }
    if (cell[0] < map.height && cell[1] < map.width) return cell;
    const size = `${count(map.height, "row")} and ${count(map.width, "column")}`;
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
  const written = new Set(blocks.map(({ name }) => name));
  const lines = blocks.map((block, index) => {
    if (EDITED.includes(block.name)) {
      // Keep num_agents if the map has no agents, because POGEMA then places num_agents agents. Keep it also if the
      // number of listed agents has not changed, because POGEMA takes the first num_agents entries of a longer list.
      const keepsCount = map.agents.length === 0 || map.agents.length === map.numListed;
      return block.name === "num_agents" && keepsCount ? block.lines : linesOf(block.name, map, true);
    }
    // An indented comment after the rows of the map would be read as a row.
    const isAfterMap = block.name === null && blocks[index - 1]?.name === "map";
    return isAfterMap ? block.lines.map((line) => line.trimStart()) : block.lines;
  });
  const end = blocks.findIndex(({ isEnd }) => isEnd);
  const added = EDITED.filter((name) => !written.has(name)).map((name) => linesOf(name, map, false));
  lines.splice(end >= 0 ? end : lines.length, 0, ...added);
  return `${lines.flat().join("\n")}\n`;
}
