// Draws the episode at one time. Coordinates are (x, y) in cells, with the corner of the map as (0, 0).

class Scene {
  constructor(film, view, ground, actors) {
    Object.assign(this, { film, view, ground, actors });
    this.teams = PALETTE.map(() => []);
    for (let agent = 0; agent < film.numAgents; agent += 1) this.teams[agent % PALETTE.length].push(agent);
    this.xs = new Float32Array(film.numAgents);
    this.ys = new Float32Array(film.numAgents);
    this.sizes = new Float32Array(film.numAgents);
  }

  drawGround() {
    const { film, view } = this;
    if (this.bitmapColor !== theme.obstacle) this.bitmap = null;
    this.bitmapColor = theme.obstacle;
    const bitmap = () => {
      return (this.bitmap ??= bitmapOf(film.isObstacle, film.height, film.width));
    };
    paintMap(view.begin(this.ground), view, film.isObstacle, bitmap);
  }

  // The integer part of `time` is a step, and its fraction the progress of the next step.
  drawActors(time, agent, options) {
    const context = this.view.begin(this.actors);
    const step = Math.min(Math.floor(time), this.film.numSteps);
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
    const { film, xs, ys, sizes } = this;
    const [top, bottom, left, right] = this.view.seen();
    const smooth = part * part * (3 - 2 * part);
    const bump = Math.sin(Math.PI * part) * 0.22;
    const next = part > 0 ? film.numAgents : 0;
    for (let agent = 0, index = step * film.numAgents; agent < film.numAgents; agent += 1, index += 1) {
      const [row, col] = [film.rows[index], film.cols[index]];
      const isSeen = row >= top - 1 && row <= bottom + 1 && col >= left - 1 && col <= right + 1;
      let size = film.flags[index] & ACTIVE ? RADIUS : 0;
      let [down, across] = [(film.rows[index + next] - row) * smooth, (film.cols[index + next] - col) * smooth];
      if (next && size > 0) {
        if (!(film.flags[index + next] & ACTIVE)) size *= 1 - smooth;
        if (film.reasonAt[index + next]) {
          const delta = DELTAS[film.actions[index + next]];
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
    this.teams.forEach((team, color) => {
      context.fillStyle = PALETTE[color];
      context.beginPath();
      for (const agent of team) {
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
    this.teams.forEach((team, color) => {
      context.strokeStyle = PALETTE[color];
      context.beginPath();
      this.eachGoal(step, team, (_, row, col) => addDisc(context, col + 0.5, row + 0.5, RADIUS, isCoarse));
      context.stroke();
    });
    context.globalAlpha = 1;
  }

  // Calls `draw(agent, row, col)` for the visible goals of the active agents of a team.
  eachGoal(step, team, draw) {
    const { film } = this;
    const [top, bottom, left, right] = this.view.seen();
    for (const agent of team) {
      const index = step * film.goalStride + agent;
      const [row, col] = [film.goalRows[index], film.goalCols[index]];
      if (!(film.flags[step * film.numAgents + agent] & ACTIVE)) continue;
      if (row < top || row > bottom || col < left || col > right) continue;
      draw(agent, row, col);
    }
  }

  drawNumbers(context) {
    this.beginNumbers(context, 600);
    for (let agent = 0; agent < this.film.numAgents; agent += 1) {
      if (this.sizes[agent] < RADIUS / 2) continue;
      context.fillStyle = INK[agent % PALETTE.length];
      context.fillText(String(agent), this.xs[agent], this.ys[agent] + 0.03);
    }
  }

  // Writes the number of its agent into each goal. Agents are drawn later, so an agent on a goal hides the number.
  drawGoalNumbers(context, step) {
    this.beginNumbers(context, 400);
    context.fillStyle = theme.text;
    const write = (agent, row, col) => context.fillText(String(agent), col + 0.5, row + 0.53);
    for (const team of this.teams) this.eachGoal(step, team, write);
  }

  beginNumbers(context, weight) {
    context.textAlign = "center";
    context.textBaseline = "middle";
    const digits = String(this.film.numAgents - 1).length;
    context.font = `${weight} ${digits < 3 ? 0.4 : 0.9 / digits}px system-ui, sans-serif`;
  }

  drawWindow(context, agent) {
    const radius = this.film.config.radius + 0.5;
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
    const { film, view } = this;
    const width = Math.max(0.12, 1.5 / view.scale);
    context.strokeStyle = colorOf(agent);
    context.lineJoin = context.lineCap = "round";
    context.lineWidth = width;
    const trace = (first, last, from) => {
      context.beginPath();
      context.moveTo(...from);
      for (let at = first; at <= last; at += 1) {
        const index = at * film.numAgents + agent;
        context.lineTo(film.cols[index] + 0.5, film.rows[index] + 0.5);
      }
    };
    const here = [this.xs[agent], this.ys[agent]];
    trace(0, step, [film.cols[agent] + 0.5, film.rows[agent] + 0.5]);
    context.lineTo(...here);
    context.stroke();
    context.globalAlpha = 0.55;
    context.setLineDash([0.01, 2.2 * width]);
    trace(step + 1, film.numSteps, here);
    context.stroke();
    context.setLineDash([]);
    context.globalAlpha = 1;
  }

  // A goal without a number gets a dot.
  drawChosen(context, step, agent, hasNumber) {
    const { film, view } = this;
    const state = film.agent(step, agent);
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
    const { view, film } = this;
    const [column, row] = [(x - view.left) / view.scale, (y - view.top) / view.scale];
    let [best, bestDistance] = [null, Math.max(0.5, 12 / view.scale)];
    for (let agent = 0; agent < film.numAgents; agent += 1) {
      if (this.sizes[agent] === 0) continue;
      const distance = Math.hypot(this.xs[agent] - column, this.ys[agent] - row);
      if (distance < bestDistance) [best, bestDistance] = [agent, distance];
    }
    return best;
  }
}
