// The episode, unpacked once into typed arrays. `pack.rs` defines the bytes.

async function unpack(header) {
  const packed = Uint8Array.from(atob(header.data), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Episode(header, await new Response(stream).arrayBuffer());
}

const DELTAS = [[0, 0], [-1, 0], [1, 0], [0, -1], [0, 1]];
const ACTIONS = ["stay", "up", "down", "left", "right"];
const ACTIVE = 1;
const ON_GOAL = 2;

// Arrays are ordered by step, then by agent: the index is `step * numAgents + agent`.
class Episode {
  constructor(header, buffer) {
    Object.assign(this, { height: header.height, width: header.width, config: header.config });
    Object.assign(this, { numAgents: header.num_agents, numSteps: header.num_steps, metrics: header.metrics ?? {} });
    this.reasons = header.reasons;
    const [agents, all] = [this.numAgents, this.numAgents * this.numSteps];
    let at = 0;
    // Copy each part, because typed arrays of multi-byte numbers need aligned offsets, and the parts are not aligned.
    const take = (length, Kind = Uint8Array) => {
      const begin = at;
      at += length * Kind.BYTES_PER_ELEMENT;
      return new Kind(buffer.slice(begin, at));
    };
    const bits = take(Math.ceil((this.height * this.width) / 8));
    const bit = (packed, index) => (packed[index >> 3] >> (index & 7)) & 1;
    const unpacked = (packed, length) => new Uint8Array(length).map((_, index) => bit(packed, index));
    this.isObstacle = unpacked(bits, this.height * this.width);
    const numNoise = (this.height + 2 * this.config.radius) * (this.width + 2 * this.config.radius);
    this.noise = header.has_noise ? unpacked(take(Math.ceil(numNoise / 8)), numNoise) : null;
    const starts = take(4 * agents, Uint16Array);
    const flags = take(agents);
    const moves = take(all);
    this.rewards = take(all, Float32Array);
    this.ended = take(all);
    const goals = take(12 * header.num_goals);
    const reverted = take(header.num_reverted);
    const others = take(header.num_others, Uint32Array);
    const marks = take(8 * header.num_marks);
    this.readStates(starts, flags, moves);
    this.readGoals(starts, new DataView(goals.buffer), header.num_goals);
    this.readReverted(reverted, others);
    this.readMarks(new DataView(marks.buffer), header.num_marks);
    this.addTotals();
  }

  readStates(starts, flags, moves) {
    const { numAgents, numSteps } = this;
    const length = numAgents * (numSteps + 1);
    this.rows = new Uint16Array(length);
    this.cols = new Uint16Array(length);
    this.flags = new Uint8Array(length);
    this.actions = new Uint8Array(length);
    for (let agent = 0; agent < numAgents; agent += 1) {
      this.rows[agent] = starts[4 * agent];
      this.cols[agent] = starts[4 * agent + 1];
      this.flags[agent] = flags[agent];
    }
    for (let index = numAgents; index < length; index += 1) {
      const code = moves[index - numAgents];
      const [down, right] = DELTAS[(code >> 3) & 7];
      this.rows[index] = this.rows[index - numAgents] + down;
      this.cols[index] = this.cols[index - numAgents] + right;
      this.flags[index] = code >> 6;
      this.actions[index] = code & 7;
    }
  }

  // If no goal ever changes, the goals are kept once, for all steps.
  readGoals(starts, view, numChanges) {
    const { numAgents, numSteps } = this;
    this.goalStride = numChanges > 0 ? numAgents : 0;
    const length = numChanges > 0 ? numAgents * (numSteps + 1) : numAgents;
    this.goalRows = new Uint16Array(length);
    this.goalCols = new Uint16Array(length);
    for (let agent = 0; agent < numAgents; agent += 1) {
      this.goalRows[agent] = starts[4 * agent + 2];
      this.goalCols[agent] = starts[4 * agent + 3];
    }
    let change = 0;
    for (let step = 1; numChanges > 0 && step <= numSteps; step += 1) {
      const here = step * numAgents;
      this.goalRows.copyWithin(here, here - numAgents, here);
      this.goalCols.copyWithin(here, here - numAgents, here);
      for (; change < numChanges && view.getUint32(12 * change, true) === step; change += 1) {
        const index = here + view.getUint32(12 * change + 4, true);
        this.goalRows[index] = view.getUint16(12 * change + 8, true);
        this.goalCols[index] = view.getUint16(12 * change + 10, true);
      }
    }
  }

  // The packed list has one entry for each reverted move, in the same order.
  readReverted(reverted, others) {
    const { numAgents, numSteps } = this;
    this.reasonAt = new Uint8Array(numAgents * (numSteps + 1));
    this.otherAt = new Map();
    let [next, nextOther] = [0, 0];
    for (let index = numAgents; index < this.reasonAt.length; index += 1) {
      const before = index - numAgents;
      const hasMoved = this.rows[index] !== this.rows[before] || this.cols[index] !== this.cols[before];
      if (!(this.flags[before] & ACTIVE) || this.actions[index] === 0 || hasMoved) continue;
      this.reasonAt[index] = reverted[next] + 1;
      if (this.reasons[reverted[next]].cause === "agent") this.otherAt.set(index, others[nextOther++]);
      next += 1;
    }
    if (next !== reverted.length) throw new Error("the packed episode is damaged");
  }

  readMarks(view, numMarks) {
    this.markAt = new Map();
    for (let mark = 0; mark < numMarks; mark += 1) {
      const step = view.getUint32(8 * mark, true);
      const cell = view.getUint16(8 * mark + 4, true) * this.width + view.getUint16(8 * mark + 6, true);
      if (!this.markAt.has(step)) this.markAt.set(step, new Set());
      this.markAt.get(step).add(cell);
    }
  }

  // Adds up the totals for the list of agents and the strip of steps.
  addTotals() {
    const { numAgents, numSteps } = this;
    this.agentReverted = new Uint32Array(numAgents);
    this.agentRewards = new Float64Array(numAgents);
    this.stepReverted = new Uint32Array(numSteps + 1);
    this.stepArrivals = new Uint32Array(numSteps + 1);
    for (let step = 1, index = numAgents; step <= numSteps; step += 1) {
      for (let agent = 0; agent < numAgents; agent += 1, index += 1) {
        this.agentRewards[agent] += this.rewards[index - numAgents];
        if (this.reasonAt[index]) {
          this.agentReverted[agent] += 1;
          this.stepReverted[step] += 1;
        }
        // Under `nothing`, agents may stay on their goals for many steps. Otherwise each flag is an arrival, even that
        // of an agent that starts on its goal and finishes in the first step.
        const arrived = this.config.on_goal !== "nothing" || !(this.flags[index - numAgents] & ON_GOAL);
        if (this.flags[index] & ON_GOAL && arrived) this.stepArrivals[step] += 1;
      }
    }
  }

  // Returns the state of one agent after a step, with its action, reward and reverted move in that step.
  agent(step, agent) {
    const index = step * this.numAgents + agent;
    const goal = step * this.goalStride + agent;
    let total = 0;
    for (let past = 0; past < step; past += 1) total += this.rewards[past * this.numAgents + agent];
    return {
      cell: [this.rows[index], this.cols[index]],
      goal: [this.goalRows[goal], this.goalCols[goal]],
      isActive: Boolean(this.flags[index] & ACTIVE),
      isOnGoal: Boolean(this.flags[index] & ON_GOAL),
      isMarked: this.isMarked(step, this.rows[index], this.cols[index]),
      action: step > 0 ? ACTIONS[this.actions[index]] : null,
      reward: step > 0 ? this.rewards[index - this.numAgents] : 0,
      total,
      isTerminated: step > 0 && Boolean(this.ended[index - this.numAgents] & 1),
      isTruncated: step > 0 && Boolean(this.ended[index - this.numAgents] & 2),
      reverted: this.revertedAt(step, agent),
    };
  }

  revertedAt(step, agent) {
    const index = step * this.numAgents + agent;
    if (step === 0 || !this.reasonAt[index]) return null;
    const { rule, cause } = this.reasons[this.reasonAt[index] - 1];
    const [down, right] = DELTAS[this.actions[index]];
    const cell = [this.rows[index] + down, this.cols[index] + right];
    return { step, action: ACTIONS[this.actions[index]], rule, cause, cell, other: this.otherAt.get(index) ?? null };
  }

  revertedOf(agent) {
    const all = [];
    for (let step = 1; step <= this.numSteps; step += 1) {
      const one = this.revertedAt(step, agent);
      if (one) all.push(one);
    }
    return all;
  }

  // Returns the marks of the occupancy grid; keeps them until the step changes.
  marks(step) {
    if (this.markCache?.step === step) return this.markCache.marks;
    const marks = new Uint8Array(this.height * this.width);
    for (let agent = 0, index = step * this.numAgents; agent < this.numAgents; agent += 1, index += 1) {
      if (this.flags[index] & ACTIVE) marks[this.rows[index] * this.width + this.cols[index]] = 1;
    }
    for (const cell of this.markAt.get(step) ?? []) marks[cell] ^= 1;
    this.markCache = { step, marks };
    return marks;
  }

  isMarked(step, row, col) {
    return Boolean(this.marks(step)[row * this.width + col]);
  }

  // Returns the observation of an agent: three windows of zeros and ones, as lists of rows.
  observe(step, agent) {
    const radius = this.config.radius;
    const side = 2 * radius + 1;
    const { cell, goal } = this.agent(step, agent);
    const marks = this.marks(step);
    const channels = { obstacles: [], agents: [], goal: [] };
    const goalAt = [0, 1].map((axis) => radius + clamp(goal[axis] - cell[axis], -radius, radius));
    for (let down = 0; down < side; down += 1) {
      const rows = { obstacles: new Uint8Array(side), agents: new Uint8Array(side), goal: new Uint8Array(side) };
      for (let right = 0; right < side; right += 1) {
        const [row, col] = [cell[0] - radius + down, cell[1] - radius + right];
        const isInside = row >= 0 && col >= 0 && row < this.height && col < this.width;
        rows.obstacles[right] = isInside ? this.isObstacle[row * this.width + col] : this.isBorderObstacle(row, col);
        rows.agents[right] = isInside ? marks[row * this.width + col] : 0;
      }
      if (down === goalAt[0]) rows.goal[goalAt[1]] = 1;
      for (const name of Object.keys(channels)) channels[name].push(rows[name]);
    }
    return channels;
  }

  // Returns 1 for the wall around the map and for noise outside it, and 0 for other cells.
  isBorderObstacle(row, col) {
    if (row >= -1 && col >= -1 && row <= this.height && col <= this.width) return 1;
    const radius = this.config.radius;
    return this.noise?.[(row + radius) * (this.width + 2 * radius) + col + radius] ?? 0;
  }
}
