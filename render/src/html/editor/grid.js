// The edited map, with undo and redo.

// Maximum size of the undo history; older states are dropped. Units: cells.
const MAX_HISTORY_CELLS = 4e7;

const emptyMap = (height, width) => ({ height, width, cells: new Uint8Array(height * width), agents: [] });

class Grid {
  constructor(onChange) {
    Object.assign(this, emptyMap(16, 16), { blocks: [], numListed: null, name: "map" });
    // `revision` identifies the state of the map; undo and redo restore it. `before` is the state before an edit that
    // has not ended.
    Object.assign(this, { onChange, revision: 0, numRevisions: 0, past: [], future: [], before: null });
  }

  // Replaces the map. `name` is the name of its file, without extension.
  load({ height, width, cells, agents, blocks = [], numListed = null }, name = "map") {
    this.edit(() => Object.assign(this, { height, width, cells, agents, blocks, numListed, name }));
    this.onChange("size");
  }

  snapshot() {
    const { height, width, cells, agents, blocks, numListed, name, revision } = this;
    return { height, width, cells: cells.slice(), agents: structuredClone(agents), blocks, numListed, name, revision };
  }

  differs(other) {
    const isSame = (field) => this[field] === other[field];
    return (
      !["height", "width", "blocks", "numListed", "name"].every(isSame) ||
      !this.cells.every((kind, index) => kind === other.cells[index]) ||
      JSON.stringify(this.agents) !== JSON.stringify(other.agents)
    );
  }

  // Makes a change that one undo reverts.
  edit(change) {
    this.begin();
    change();
    this.commit();
  }

  // Begins a change that `commit` ends or `rollback` reverts.
  begin() {
    this.commit();
    this.before = this.snapshot();
  }

  // Ends a change. If the state is the same as before, undo and redo stay as they were.
  commit() {
    const { before } = this;
    this.before = null;
    if (!before || !this.differs(before)) return;
    this.revision = this.numRevisions += 1;
    this.past.push(before);
    this.future = [];
    let kept = 0;
    const first = this.past.findLastIndex((one) => (kept += one.cells.length) > MAX_HISTORY_CELLS);
    this.past.splice(0, first + 1);
  }

  rollback() {
    const { before } = this;
    this.before = null;
    if (before) this.restore(before);
  }

  undo() {
    this.exchange(this.past, this.future);
  }

  redo() {
    this.exchange(this.future, this.past);
  }

  exchange(from, to) {
    if (this.before || from.length === 0) return;
    to.push(this.snapshot());
    this.restore(from.pop());
  }

  restore(state) {
    const isResized = state.height !== this.height || state.width !== this.width;
    Object.assign(this, state);
    this.onChange(isResized ? "size" : "cells");
  }

  contains([row, col]) {
    return row >= 0 && col >= 0 && row < this.height && col < this.width;
  }

  indexOf([row, col]) {
    return row * this.width + col;
  }

  at(cell) {
    return this.cells[this.indexOf(cell)];
  }

  // Sets cells, given by index, but never places an obstacle on a start or a goal.
  paint(indices, kind) {
    const agents = kind === OBSTACLE ? this.agents : [];
    const taken = new Set(agents.flatMap((agent) => [agent.start, ...goalsOf(agent)].map((cell) => this.indexOf(cell))));
    for (const index of indices) if (!taken.has(index)) this.cells[index] = kind;
  }

  // Sets all cells on a straight line, so that a fast stroke has no gaps.
  line([fromRow, fromCol], [toRow, toCol], kind) {
    const length = Math.max(Math.abs(toRow - fromRow), Math.abs(toCol - fromCol), 1);
    const along = (from, to, at) => Math.round(from + ((to - from) * at) / length);
    const cell = (_, at) => this.indexOf([along(fromRow, toRow, at), along(fromCol, toCol, at)]);
    this.paint(Array.from({ length: length + 1 }, cell), kind);
  }

  rectangle([oneRow, oneCol], [otherRow, otherCol], kind) {
    const { width } = this;
    const indices = function* () {
      for (let row = Math.min(oneRow, otherRow); row <= Math.max(oneRow, otherRow); row += 1) {
        for (let col = Math.min(oneCol, otherCol); col <= Math.max(oneCol, otherCol); col += 1) yield row * width + col;
      }
    };
    this.paint(indices(), kind);
  }

  // Fills the connected cells of the same kind.
  fill(from, kind) {
    const old = this.at(from);
    if (old === kind) return;
    const queue = new Int32Array(this.cells.length);
    const isSeen = new Uint8Array(this.cells.length);
    const length = flood(this, this.indexOf(from), queue, (index) => {
      if (isSeen[index] || this.cells[index] !== old) return false;
      isSeen[index] = 1;
      return true;
    });
    this.paint(queue.subarray(0, length), kind);
  }

  // Returns the agent whose start or goal is on a cell, as { agent, part }, or null. Starts come first, then first
  // goals, then later goals.
  agentOn(cell) {
    const isHere = (other) => other !== null && other[0] === cell[0] && other[1] === cell[1];
    const parts = { start: ({ start }) => isHere(start), goal: ({ goal }) => isHere(goal), "later goal": ({ more }) => more.some(isHere) };
    for (const [part, isOn] of Object.entries(parts)) {
      const agent = this.agents.findIndex(isOn);
      if (agent >= 0) return { agent, part };
    }
    return null;
  }

  addAgent(start) {
    this.agents.push({ start, goal: null, more: [] });
    return this.agents.length - 1;
  }

  // Moves a start or a goal. Two agents may share a goal, but not a start.
  moveAgent(agent, part, cell) {
    const isTaken = (other, index) => index !== agent && String(other.start) === String(cell);
    if (part === "start" && this.agents.some(isTaken)) return;
    this.agents[agent][part] = cell;
  }

  // Removes the obstacle on a cell.
  clear(cell) {
    if (this.at(cell) === OBSTACLE) this.paint([this.indexOf(cell)], FREE);
  }

  // Resizes the map. Removes agents whose start or first goal is outside it, and later goals outside it. Returns both
  // counts.
  resize(height, width) {
    const cells = new Uint8Array(height * width);
    for (let row = 0; row < Math.min(height, this.height); row += 1) {
      const line = this.cells.subarray(row * this.width, row * this.width + Math.min(width, this.width));
      cells.set(line, row * width);
    }
    const fits = (cell) => cell === null || (cell[0] < height && cell[1] < width);
    const numGoals = (agents) => agents.reduce((sum, { more }) => sum + more.length, 0);
    const kept = this.agents.filter(({ start, goal }) => fits(start) && fits(goal));
    const agents = kept.map((agent) => ({ ...agent, more: agent.more.filter(fits) }));
    const removed = [this.agents.length - agents.length, numGoals(kept) - numGoals(agents)];
    this.edit(() => Object.assign(this, { height, width, cells, agents }));
    this.onChange("size");
    return removed;
  }
}

// Returns the goals of an agent in order; none if it has no goal yet.
const goalsOf = ({ goal, more }) => (goal === null ? [] : [goal, ...more]);
