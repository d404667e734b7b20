// Map text, with POGEMA's syntax.

// An error in a file, with its position; lines and columns count from 1.
class ParseError extends Error {
  constructor(line, column, reason) {
    super(`line ${line}, column ${column}: ${reason}`);
    Object.assign(this, { line, column, reason });
  }
}

// One character for each kind of cell.
const MATERIALS = ".#@$!";
const FREE = 0;
const OBSTACLE = 1;

// Parses map text; any whitespace separates rows. `lineAt` and `columnAt` are the position of the text in its file.
function parseMapText(text, lineAt = 1, columnAt = 1) {
  const rows = [];
  const letters = new Map();
  let pool = null;
  text.split("\n").forEach((line, down) => {
    for (const word of line.matchAll(/[^\s]+/g)) {
      const cells = [];
      const here = (col) => [lineAt + down, columnAt + [...line.slice(0, word.index)].length + col];
      [...word[0]].forEach((character, col) => {
        const kind = MATERIALS.indexOf(character);
        if (kind < 0 && !/[a-zA-Z]/.test(character)) {
          throw new ParseError(...here(col), `unknown character "${character}", expected one of .#@$!, a-z or A-Z`);
        }
        if (kind < 0) letters.set(character, { cell: [rows.length, col], at: here(col) });
        if (kind > OBSTACLE) pool ??= here(col);
        cells.push(Math.max(kind, FREE));
      });
      const [first = cells] = rows;
      if (cells.length !== first.length) {
        const at = here(Math.min(cells.length, first.length));
        const found = count(cells.length, "cell");
        throw new ParseError(...at, `the row has ${found}, expected ${first.length} as in the first row`);
      }
      rows.push(cells);
    }
  });
  if (rows.length === 0) throw new ParseError(lineAt, columnAt, "the map has no cell, expected some of .#@$!, a-z and A-Z");
  const all = Uint8Array.from(rows.flat());
  return { height: rows.length, width: rows[0].length, cells: all, agents: pairLetters(letters, pool) };
}

// Pairs starts and goals in alphabetical order: the first lower-case letter with the first upper-case letter.
function pairLetters(letters, pool) {
  const sorted = [...letters].sort(([one], [other]) => (one < other ? -1 : 1));
  const starts = sorted.filter(([letter]) => letter >= "a");
  const goals = sorted.filter(([letter]) => letter < "a");
  if (starts.length !== goals.length) {
    const [, { at }] = (starts.length > goals.length ? starts : goals).at(-1);
    const found = `${count(starts.length, "start")} (a-z) and ${count(goals.length, "goal")} (A-Z)`;
    throw new ParseError(...at, `the map has ${found}, expected equal numbers`);
  }
  if (starts.length > 0 && pool) {
    throw new ParseError(...pool, "the map has letters and one of @$!, expected either exact or possible starts and goals");
  }
  return starts.map(([, { cell }], agent) => ({ start: cell, goal: goals[agent][1].cell, more: [] }));
}

function rowsOf({ height, width, cells }) {
  const line = (row) => Array.from(cells.subarray(row * width, (row + 1) * width), (kind) => MATERIALS[kind]);
  return Array.from({ length: height }, (_, row) => line(row));
}

// Returns the reason why a map cannot be written as text, or null.
function unfitForText({ cells, agents }) {
  if (agents.length > 26) return `text has letters for 26 agents, but the map has ${agents.length}; save it as YAML`;
  if (agents.length === 0) return null;
  if (agents.some((agent) => agent.more.length > 0)) return "text has only one goal for each agent; save it as YAML";
  const taken = new Set();
  for (const [index, { start, goal }] of agents.entries()) {
    for (const cell of [start, goal]) {
      if (taken.has(String(cell))) return `text has one letter for each cell, but ${place(cell)} needs two (agent ${index}); save it as YAML`;
      taken.add(String(cell));
    }
  }
  if (cells.some((kind) => kind > OBSTACLE)) return "text cannot contain both agents and @ $ !; save it as YAML";
  return null;
}

function formatMapText(map) {
  const rows = rowsOf(map);
  map.agents.forEach(({ start, goal }, agent) => {
    const letter = String.fromCharCode(97 + agent);
    rows[start[0]][start[1]] = letter;
    rows[goal[0]][goal[1]] = letter.toUpperCase();
  });
  return `${rows.map((row) => row.join("")).join("\n")}\n`;
}
