// Checks of a map: its components, and agents that cannot reach their goals.

// Visits the cells that are connected to the cell `first`, and returns their number. `enter(index)` returns whether a
// cell belongs to them and is new. Afterwards, `queue` begins with their indices.
function flood({ height, width }, first, queue, enter) {
  let [head, tail] = [0, 0];
  const visit = (index) => {
    if (enter(index)) queue[tail++] = index;
  };
  visit(first);
  while (head < tail) {
    const index = queue[head++];
    const col = index % width;
    if (index >= width) visit(index - width);
    if (index < width * (height - 1)) visit(index + width);
    if (col > 0) visit(index - 1);
    if (col < width - 1) visit(index + 1);
  }
  return tail;
}

// Numbers the components from 1; obstacles get 0.
function componentsOf(map) {
  const { cells } = map;
  const labels = new Int32Array(cells.length);
  const queue = new Int32Array(cells.length);
  let number = 0;
  const isNew = (index) => cells[index] !== OBSTACLE && labels[index] === 0;
  const enter = (index) => {
    if (!isNew(index)) return false;
    labels[index] = number;
    return true;
  };
  for (let first = 0; first < cells.length; first += 1) {
    if (!isNew(first)) continue;
    number += 1;
    flood(map, first, queue, enter);
  }
  return { labels, number };
}

function check(grid) {
  const { labels, number } = componentsOf(grid);
  const free = grid.cells.reduce((sum, kind) => sum + (kind === OBSTACLE ? 0 : 1), 0);
  const issues = [];
  const starts = new Map();
  const label = ([row, col]) => labels[row * grid.width + col];
  grid.agents.forEach((one, agent) => {
    const { start, goal, more } = one;
    const add = (reason) => issues.push({ agent, reason: `agent ${agent} ${reason}` });
    if (starts.has(String(start))) add(`starts on ${place(start)}, like agent ${starts.get(String(start))}`);
    starts.set(String(start), agent);
    if (label(start) === 0) add("starts on an obstacle, which POGEMA removes");
    if (goal === null) add("has no goal yet");
    goalsOf(one).forEach((cell, index) => {
      const name = more.length > 0 ? `goal ${place(cell)}` : "goal";
      // POGEMA removes no obstacle from a goal after the first.
      if (label(cell) === 0) add(`has its ${name} on an obstacle${index === 0 ? ", which POGEMA removes" : ""}`);
      else if (label(start) !== 0 && label(start) !== label(cell)) add(`cannot reach its ${name}: it is in another component`);
    });
  });
  const restarts = grid.blocks.some((block) => block.name === "on_target" && scalarOf(block) === "restart");
  const hasSequences = grid.agents.some(({ more }) => more.length > 0);
  if ((restarts || hasSequences) && grid.agents.some(({ more }) => more.length === 0)) {
    const reason = restarts ? "on_target is restart" : "agents have sequences of goals";
    issues.push({ agent: null, reason: `${reason}, expected at least two goals for each agent` });
  }
  return { labels, number, free, density: 1 - free / grid.cells.length, issues };
}
