// The edited map, with undo and redo.

// Maximum size of the undo history; older states are dropped. Units: cells.
const LONGEST_MEMORY = 4e7;

class Grid {
  constructor(onChange) {
    this.onChange = onChange;
    this.load({ height: 16, width: 16, cells: new Uint8Array(256), agents: [], blocks: [] });
  }

  load({ height, width, cells, agents, blocks = [], numListed = null }) {
    Object.assign(this, { height, width, cells, agents, blocks, numListed, past: [], future: [] });
    this.onChange?.("size");
  }

  snapshot() {
    const { height, width, cells, agents, blocks } = this;
    return { height, width, cells: cells.slice(), agents: structuredClone(agents), blocks };
  }

  // Stores the state for undo. Call this before a change.
  remember() {
    this.past.push(this.snapshot());
    this.future = [];
    let kept = 0;
    const first = this.past.findLastIndex((one) => (kept += one.cells.length) > LONGEST_MEMORY);
    this.past.splice(0, first + 1);
  }

  // Restores the last stored state, without redo.
  forget() {
    this.restore(this.past.pop());
  }

  undo() {
    this.exchange(this.past, this.future);
  }

  redo() {
    this.exchange(this.future, this.past);
  }

  exchange(from, to) {
    if (from.length === 0) return;
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

  at([row, col]) {
    return this.cells[row * this.width + col];
  }

  // Sets a cell, but never places an obstacle on a start or a goal.
  put([row, col], kind) {
    if (!this.contains([row, col])) return;
    if (kind === OBSTACLE && this.agentOn([row, col])) return;
    this.cells[row * this.width + col] = kind;
  }

  // Sets all cells on a straight line, so that a fast stroke has no gaps.
  line([fromRow, fromCol], [toRow, toCol], kind) {
    const length = Math.max(Math.abs(toRow - fromRow), Math.abs(toCol - fromCol), 1);
    for (let at = 0; at <= length; at += 1) {
      const along = (from, to) => Math.round(from + ((to - from) * at) / length);
      this.put([along(fromRow, toRow), along(fromCol, toCol)], kind);
    }
  }

  rectangle([oneRow, oneCol], [otherRow, otherCol], kind) {
    for (let row = Math.min(oneRow, otherRow); row <= Math.max(oneRow, otherRow); row += 1) {
      for (let col = Math.min(oneCol, otherCol); col <= Math.max(oneCol, otherCol); col += 1) this.put([row, col], kind);
    }
  }

  // Fills the connected cells of the same kind.
  fill(from, kind) {
    const old = this.at(from);
    if (old === kind) return;
    const queue = [from];
    const seen = new Uint8Array(this.cells.length);
    while (queue.length > 0) {
      const [row, col] = queue.pop();
      const index = row * this.width + col;
      if (!this.contains([row, col]) || seen[index] || this.cells[index] !== old) continue;
      seen[index] = 1;
      this.put([row, col], kind);
      queue.push([row - 1, col], [row + 1, col], [row, col - 1], [row, col + 1]);
    }
  }

  // Returns the agent whose start or goal is on a cell, starts first, as { agent, part }, or null.
  agentOn(cell) {
    const isHere = (other) => other !== null && other[0] === cell[0] && other[1] === cell[1];
    for (const part of ["start", "goal"]) {
      const agent = this.agents.findIndex((one) => isHere(one[part]));
      if (agent >= 0) return { agent, part };
    }
    return null;
  }

  addAgent(start) {
    this.clear(start);
    this.agents.push({ start, goal: null, more: [] });
    return this.agents.length - 1;
  }

  // Moves a start or a goal. Two agents may share a goal, but not a start.
  moveAgent(agent, part, cell) {
    const isTaken = (other, index) => index !== agent && String(other.start) === String(cell);
    if (part === "start" && this.agents.some(isTaken)) return;
    this.clear(cell);
    this.agents[agent][part] = cell;
  }

  clear(cell) {
    if (this.at(cell) === OBSTACLE) this.put(cell, FREE);
  }

  // Resizes the map, removes agents outside it and returns their number.
  resize(height, width) {
    const cells = new Uint8Array(height * width);
    for (let row = 0; row < Math.min(height, this.height); row += 1) {
      const line = this.cells.subarray(row * this.width, row * this.width + Math.min(width, this.width));
      cells.set(line, row * width);
    }
    const fits = (cell) => cell === null || (cell[0] < height && cell[1] < width);
    const before = this.agents.length;
    const agents = this.agents.filter(({ start, goal }) => fits(start) && fits(goal));
    for (const agent of agents) agent.more = agent.more.filter(fits);
    Object.assign(this, { height, width, cells, agents });
    this.onChange("size");
    return before - agents.length;
  }
}
