// A complete port to copy: a small environment, and the adapter that connects it to the checks. Replace `Environment`
// with your own environment, and list its abilities in `CLAIMS`. docs/PORTING.md explains the questions and answers.
//
// Needs Node 18 or newer and nothing else:   node template.mjs

import { realpathSync } from "node:fs";
import { createInterface } from "node:readline";
import { pathToFileURL } from "node:url";

// ------------------------------------ The environment. Replace it with yours. ---------------------------------------

const MOVES = [[0, 0], [-1, 0], [1, 0], [0, -1], [0, 1]]; // stay, up, down, left, right
const isSame = (one, other) => one[0] === other[0] && one[1] === other[1];
const clamp = (number, limit) => Math.min(Math.max(number, -limit), limit);

// POGEMA with the collision system `block_both`: an agent moves if its target is free before the step and no other
// agent has the same target.
class Environment {
  constructor(instance) {
    const { collision, reward, radius, max_steps, on_goal } = instance.config;
    if (collision !== "block_both" || reward !== "own" || (instance.outside ?? "free") !== "free") {
      throw new Error("the instance uses rules that this port does not claim");
    }
    Object.assign(this, { radius, maxSteps: max_steps, onGoal: on_goal, map: instance.map });
    Object.assign(this, { starts: instance.starts, goalLists: instance.goals });
  }

  // Begins a new episode. All agents are active, even an agent that starts on its goal.
  reset() {
    this.steps = 0;
    this.cells = [...this.starts];
    this.goals = this.goalLists.map((goals) => goals[0]);
    this.reached = this.cells.map(() => 0); // for each agent, the number of goals it has reached
    this.active = this.cells.map(() => true);
  }

  // A wall one cell wide surrounds the map, and free cells surround the wall.
  isObstacle([row, col]) {
    const [height, width] = [this.map.length, this.map[0].length];
    if (row < 0 || row >= height || col < 0 || col >= width) {
      return row >= -1 && row <= height && col >= -1 && col <= width;
    }
    return this.map[row][col] === "#";
  }

  isTaken(cell) {
    return this.cells.some((other, agent) => this.active[agent] && isSame(other, cell));
  }

  step(actions) {
    if (actions.length !== this.cells.length || actions.some((action) => !(action in MOVES))) {
      throw new Error(`expected ${this.cells.length} actions from 0 to 4`); // the state is unchanged
    }
    const targets = this.cells.map(([row, col], agent) => {
      const there = [row + MOVES[actions[agent]][0], col + MOVES[actions[agent]][1]];
      return this.active[agent] && !this.isObstacle(there) && !this.isTaken(there) ? there : null;
    });
    this.cells = this.cells.map((cell, agent) => {
      const target = targets[agent];
      return target && targets.filter((other) => other && isSame(other, target)).length === 1 ? target : cell;
    });
    this.steps += 1;
    const onGoal = this.cells.map((cell, agent) => isSame(cell, this.goals[agent]));
    const areAllThere = onGoal.every(Boolean);
    const isPaid = onGoal.map((is, agent) => (this.onGoal === "nothing" ? areAllThere : is && this.active[agent]));
    // Under `finish`, agents that finished earlier are also terminated, although they get no more rewards.
    const terminated = { finish: onGoal, nothing: isPaid, restart: onGoal.map(() => false) }[this.onGoal];
    isPaid.forEach((isPaid, agent) => isPaid && this.arrive(agent));
    return { rewards: isPaid.map(Number), terminated, truncated: onGoal.map(() => this.steps >= this.maxSteps) };
  }

  // Applies the effect of a reached goal, after all moves and rewards and before observations.
  arrive(agent) {
    if (this.onGoal === "finish") {
      this.active[agent] = false;
    } else if (this.onGoal === "restart") {
      this.reached[agent] += 1;
      this.goals[agent] = this.goalLists[agent][this.reached[agent] % this.goalLists[agent].length];
    }
  }

  // Returns the observation of an agent, also of a finished one: obstacles, active agents (itself included), goal.
  observe(agent) {
    const [[row, col], goal, radius] = [this.cells[agent], this.goals[agent], this.radius];
    // A goal outside the window is drawn on its edge: each axis is clamped separately.
    const mark = [row + clamp(goal[0] - row, radius), col + clamp(goal[1] - col, radius)];
    const steps = Array.from({ length: 2 * radius + 1 }, (_, index) => index - radius);
    const channel = (has) => steps.map((down) => steps.map((right) => Number(has([row + down, col + right]))));
    const hasAgent = (cell) => this.isTaken(cell);
    return [channel((cell) => this.isObstacle(cell)), channel(hasAgent), channel((cell) => isSame(cell, mark))];
  }
}

// ------------------------------- The adapter: turns questions into calls and results into answers. ----------------

const CLAIMS = {
  protocol: "pogema-conform/1",
  name: "template.mjs",
  version: "1",
  profiles: ["core", "observations"],
  collision: ["block_both"],
  on_goal: ["finish", "nothing", "restart"],
  observation: ["default"],
};

let environment = null;

// Executes a `reset` or a `step`; the two answers share the keys of the state.
function play({ type, actions }) {
  const results = type === "reset" ? environment.reset() : environment.step(actions);
  const { cells, goals, active } = environment;
  return { cells, goals, active, ...results, observations: cells.map((_, agent) => environment.observe(agent)) };
}

// Answers a question. A refusal is also an answer.
export function answer(question) {
  const { type, instance, config } = question;
  if (type === "hello") return CLAIMS;
  try {
    if (instance) {
      // Without an instance, `reset` resets the current environment.
      environment = null;
      environment = new Environment(instance);
    }
    if (environment && ["reset", "step"].includes(type) && !config) return play(question);
    throw new Error("this port does not support this question, or no instance was sent yet");
  } catch (error) {
    return { error: String(error) };
  }
}

// Reads one question per line and writes one answer per line, until `bye`.
async function main() {
  for await (const line of createInterface({ input: process.stdin })) {
    const question = JSON.parse(line);
    if (question.type === "bye") break;
    console.log(JSON.stringify(answer(question)));
  }
}

// The path of the program may contain symbolic links.
if (import.meta.url === pathToFileURL(realpathSync(process.argv[1])).href) await main();
