// Checks of a map: its components, and agents that cannot reach their goals.

// Numbers the components from 1; obstacles get 0.
function componentsOf({ height, width, cells }) {
  const labels = new Int32Array(cells.length);
  const queue = new Int32Array(cells.length);
  let number = 0;
  for (let first = 0; first < cells.length; first += 1) {
    if (cells[first] === OBSTACLE || labels[first]) continue;
    number += 1;
    labels[first] = number;
    let [head, tail] = [0, 0];
    queue[tail++] = first;
    const visit = (next) => {
      if (cells[next] === OBSTACLE || labels[next]) return;
      labels[next] = number;
      queue[tail++] = next;
    };
    while (head < tail) {
      const index = queue[head++];
      const col = index % width;
      if (index >= width) visit(index - width);
      if (index < width * (height - 1)) visit(index + width);
      if (col > 0) visit(index - 1);
      if (col < width - 1) visit(index + 1);
    }
  }
  return { labels, number };
}

function check(grid) {
  const { labels, number } = componentsOf(grid);
  const free = grid.cells.reduce((sum, kind) => sum + (kind === OBSTACLE ? 0 : 1), 0);
  const issues = [];
  const starts = new Map();
  const label = ([row, col]) => labels[row * grid.width + col];
  grid.agents.forEach(({ start, goal }, agent) => {
    const add = (reason) => issues.push({ agent, reason: `agent ${agent} ${reason}` });
    if (starts.has(String(start))) add(`starts on ${place(start)}, like agent ${starts.get(String(start))}`);
    starts.set(String(start), agent);
    if (label(start) === 0) add("starts on an obstacle, which POGEMA removes");
    if (goal === null) return add("has no goal yet");
    if (label(goal) === 0) return add("has its goal on an obstacle, which POGEMA removes");
    if (label(start) !== 0 && label(start) !== label(goal)) add("cannot reach its goal: it is in another component");
  });
  const restarts = grid.blocks.some(({ name, lines }) => name === "on_target" && /restart/.test(lines[0]));
  if (restarts && grid.agents.some((agent) => agent.more.length === 0)) {
    issues.push({ agent: null, reason: "on_target is restart, expected at least two goals for each agent" });
  }
  return { labels, number, free, density: 1 - free / grid.cells.length, issues };
}
