// Draws the episode at one time. Coordinates are (x, y) in cells, with the corner of the map as (0, 0).

class Scene {
  constructor(episode, view, ground, actors) {
    Object.assign(this, { episode, view, ground, actors });
    this.agentsByColor = PALETTE.map(() => []);
    for (let agent = 0; agent < episode.numAgents; agent += 1) this.agentsByColor[agent % PALETTE.length].push(agent);
    this.xs = new Float32Array(episode.numAgents);
    this.ys = new Float32Array(episode.numAgents);
    this.sizes = new Float32Array(episode.numAgents);
  }

  drawGround() {
    const { episode, view } = this;
    if (this.bitmapColor !== theme.obstacle) this.bitmap = null;
    this.bitmapColor = theme.obstacle;
    const bitmap = () => {
      return (this.bitmap ??= bitmapOf(episode.isObstacle, episode.height, episode.width));
    };
    paintMap(view.begin(this.ground), view, episode.isObstacle, bitmap);
  }

  // The integer part of `time` is a step, and its fraction the progress of the next step.
  drawActors(time, agent, options) {
    const context = this.view.begin(this.actors);
    const step = Math.min(Math.floor(time), this.episode.numSteps);
    this.place(step, time - step);
    const isCoarse = this.view.scale < COARSE;
    if (agent !== null) this.drawWindow(context, agent);
    const hasNumbers = options.numbers && this.view.scale >= NUMBERS_FROM;
    if (options.goals) this.drawGoals(context, step, isCoarse);
    if (options.goals && hasNumbers) this.drawGoalNumbers(context, step);
    if (agent !== null) this.drawPath(context, step, agent);
    this.drawAgents(context, isCoarse);
    if (hasNumbers) this.drawNumbers(context);
    if (agent !== null) this.drawChosen(context, step, agent, options.goals && hasNumbers);
  }

  // Computes the position and the size of every agent; the size of invisible and finished agents is 0.
  place(step, part) {
    const { episode, xs, ys, sizes } = this;
    const [top, bottom, left, right] = this.view.seen();
    const smooth = part * part * (3 - 2 * part);
    const bump = Math.sin(Math.PI * part) * 0.22;
    const next = part > 0 ? episode.numAgents : 0;
    for (let agent = 0, index = step * episode.numAgents; agent < episode.numAgents; agent += 1, index += 1) {
      const [row, col] = [episode.rows[index], episode.cols[index]];
      const isSeen = row >= top - 1 && row <= bottom + 1 && col >= left - 1 && col <= right + 1;
      let size = episode.flags[index] & ACTIVE ? RADIUS : 0;
      let [down, across] = [(episode.rows[index + next] - row) * smooth, (episode.cols[index + next] - col) * smooth];
      if (next && size > 0) {
        if (!(episode.flags[index + next] & ACTIVE)) size *= 1 - smooth;
        if (episode.reasonAt[index + next]) {
          const delta = DELTAS[episode.actions[index + next]];
          [down, across] = [delta[0] * bump, delta[1] * bump];
        }
      }
      xs[agent] = col + 0.5 + across;
      ys[agent] = row + 0.5 + down;
      sizes[agent] = isSeen ? size : 0;
    }
  }

  drawAgents(context, isCoarse) {
    // Draw agents larger at small scales, so that all remain visible.
    const least = 1.6 / this.view.scale;
    this.agentsByColor.forEach((agents, color) => {
      context.fillStyle = PALETTE[color];
      context.beginPath();
      for (const agent of agents) {
        const size = this.sizes[agent];
        if (size > 0) addDisc(context, this.xs[agent], this.ys[agent], Math.max(size, least), isCoarse);
      }
      context.fill();
    });
  }

  drawGoals(context, step, isCoarse) {
    const { view } = this;
    context.lineWidth = isCoarse ? Math.max(LINE, 0.6 / view.scale) : LINE;
    if (isCoarse) context.globalAlpha = 0.5;
    this.agentsByColor.forEach((agents, color) => {
      context.strokeStyle = PALETTE[color];
      context.beginPath();
      this.eachGoal(step, agents, (_, row, col) => addDisc(context, col + 0.5, row + 0.5, RADIUS, isCoarse));
      context.stroke();
    });
    context.globalAlpha = 1;
  }

  // Calls `draw(agent, row, col)` for each active agent in `agents` whose goal is visible.
  eachGoal(step, agents, draw) {
    const { episode } = this;
    const [top, bottom, left, right] = this.view.seen();
    for (const agent of agents) {
      const index = step * episode.goalStride + agent;
      const [row, col] = [episode.goalRows[index], episode.goalCols[index]];
      if (!(episode.flags[step * episode.numAgents + agent] & ACTIVE)) continue;
      if (row < top || row > bottom || col < left || col > right) continue;
      draw(agent, row, col);
    }
  }

  drawNumbers(context) {
    this.beginNumbers(context, 600);
    for (let agent = 0; agent < this.episode.numAgents; agent += 1) {
      if (this.sizes[agent] < RADIUS / 2) continue;
      context.fillStyle = INK[agent % PALETTE.length];
      context.fillText(String(agent), this.xs[agent], this.ys[agent] + 0.03);
    }
  }

  // Writes the number of each agent into its goal. Agents are drawn later, so an agent on a goal hides the number.
  drawGoalNumbers(context, step) {
    this.beginNumbers(context, 400);
    context.fillStyle = theme.text;
    const write = (agent, row, col) => context.fillText(String(agent), col + 0.5, row + 0.53);
    for (const agents of this.agentsByColor) this.eachGoal(step, agents, write);
  }

  beginNumbers(context, weight) {
    context.textAlign = "center";
    context.textBaseline = "middle";
    const digits = String(this.episode.numAgents - 1).length;
    context.font = `${weight} ${digits < 3 ? 0.4 : 0.9 / digits}px system-ui, sans-serif`;
  }

  drawWindow(context, agent) {
    const radius = this.episode.config.radius + 0.5;
    const [x, y] = [this.xs[agent], this.ys[agent]];
    context.fillStyle = colorOf(agent);
    context.globalAlpha = 0.13;
    context.fillRect(x - radius, y - radius, 2 * radius, 2 * radius);
    context.globalAlpha = 1;
    context.strokeStyle = colorOf(agent);
    context.lineWidth = 1.5 / this.view.scale;
    context.strokeRect(x - radius, y - radius, 2 * radius, 2 * radius);
  }

  // Draws the path so far as a line and the future path as dots.
  drawPath(context, step, agent) {
    const { episode, view } = this;
    const width = Math.max(0.12, 1.5 / view.scale);
    context.strokeStyle = colorOf(agent);
    context.lineJoin = context.lineCap = "round";
    context.lineWidth = width;
    const trace = (first, last, from) => {
      context.beginPath();
      context.moveTo(...from);
      for (let at = first; at <= last; at += 1) {
        const index = at * episode.numAgents + agent;
        context.lineTo(episode.cols[index] + 0.5, episode.rows[index] + 0.5);
      }
    };
    const here = [this.xs[agent], this.ys[agent]];
    trace(0, step, [episode.cols[agent] + 0.5, episode.rows[agent] + 0.5]);
    context.lineTo(...here);
    context.stroke();
    context.globalAlpha = 0.55;
    context.setLineDash([0.01, 2.2 * width]);
    trace(step + 1, episode.numSteps, here);
    context.stroke();
    context.setLineDash([]);
    context.globalAlpha = 1;
  }

  // A goal without a number gets a dot.
  drawChosen(context, step, agent, hasNumber) {
    const { episode, view } = this;
    const state = episode.agent(step, agent);
    const ring = (x, y, color, radius, dash) => {
      context.strokeStyle = color;
      context.lineWidth = Math.max(0.08, 2 / view.scale);
      context.setLineDash(dash);
      context.beginPath();
      context.arc(x, y, Math.max(radius, 6 / view.scale), 0, 2 * Math.PI);
      context.stroke();
      context.setLineDash([]);
    };
    if (state.isActive) {
      context.fillStyle = colorOf(agent);
      context.beginPath();
      const dot = hasNumber ? 0 : Math.max(0.14, 2.5 / view.scale);
      context.arc(state.goal[1] + 0.5, state.goal[0] + 0.5, dot, 0, 2 * Math.PI);
      context.fill();
      ring(state.goal[1] + 0.5, state.goal[0] + 0.5, colorOf(agent), RADIUS, []);
    }
    ring(this.xs[agent], this.ys[agent], theme.text, 0.47, state.isActive ? [] : [0.15, 0.1]);
    if (!state.reverted) return;
    const { cell, other } = state.reverted;
    // Mark the blocking agent, or else the blocking cell.
    if (other === null) ring(cell[1] + 0.5, cell[0] + 0.5, theme.bad, 0.47, []);
    else ring(this.xs[other], this.ys[other], theme.bad, 0.47, []);
  }

  // Returns the agent nearest to a point, or null if none is near enough for a click.
  agentAt(x, y) {
    const { view, episode } = this;
    const [column, row] = [(x - view.left) / view.scale, (y - view.top) / view.scale];
    let [best, bestDistance] = [null, Math.max(0.5, 12 / view.scale)];
    for (let agent = 0; agent < episode.numAgents; agent += 1) {
      if (this.sizes[agent] === 0) continue;
      const distance = Math.hypot(this.xs[agent] - column, this.ys[agent] - row);
      if (distance < bestDistance) [best, bestDistance] = [agent, distance];
    }
    return best;
  }
}
