// Draws the edited map. Coordinates are (x, y) in cells, with the corner of the map as (0, 0).

class Canvas {
  constructor(grid, view, ground, actors) {
    Object.assign(this, { grid, view, ground, actors, tints: null, report: null });
    this.renew();
  }

  // Call this after cells have changed.
  renew() {
    this.isObstacle = this.grid.cells.map((kind) => (kind === OBSTACLE ? 1 : 0));
    this.bitmap = null;
  }

  draw({ cursor, chosen, box, isTinted }) {
    const { grid, view } = this;
    const bitmap = () => (this.bitmap ??= bitmapOf(this.isObstacle, grid.height, grid.width));
    const ground = view.begin(this.ground);
    paintMap(ground, view, this.isObstacle, bitmap);
    if (isTinted && this.tints) {
      ground.imageSmoothingEnabled = false;
      ground.drawImage(this.tints, 0, 0);
    }
    this.drawPools(ground);
    const context = view.begin(this.actors);
    this.drawAgents(context, chosen);
    if (box) this.drawBox(context, box);
    if (cursor) this.drawBox(context, [cursor, cursor]);
  }

  // Colours each component in its own pale colour.
  tint({ labels }) {
    const { height, width } = this.grid;
    this.tints = make("canvas", { width, height });
    const context = this.tints.getContext("2d");
    const image = context.createImageData(width, height);
    for (let index = 0; index < labels.length; index += 1) {
      if (labels[index] === 0) continue;
      const color = colorOf(labels[index] - 1);
      const channels = channelsOf(color);
      image.data.set([...channels, 70], 4 * index);
    }
    context.putImageData(image, 0, 0);
  }

  drawPools(context) {
    const { grid, view } = this;
    const [top, bottom, left, right] = view.seen();
    context.fillStyle = theme.soft;
    context.font = "0.55px ui-monospace, monospace";
    context.textAlign = "center";
    context.textBaseline = "middle";
    for (let row = top; row <= bottom; row += 1) {
      for (let col = left; col <= right; col += 1) {
        const kind = grid.cells[row * grid.width + col];
        if (kind <= OBSTACLE) continue;
        if (view.scale < COARSE) context.fillRect(col + 0.3, row + 0.3, 0.4, 0.4);
        else context.fillText(MATERIALS[kind], col + 0.5, row + 0.53);
      }
    }
  }

  drawAgents(context, chosen) {
    const { grid, view } = this;
    const isCoarse = view.scale < COARSE;
    const flagged = new Set(this.report?.issues.map((issue) => issue.agent));
    grid.agents.forEach(({ start, goal, more }, agent) => {
      context.strokeStyle = context.fillStyle = colorOf(agent);
      for (const later of more) {
        context.lineWidth = LINE;
        context.beginPath();
        addDisc(context, later[1] + 0.5, later[0] + 0.5, RADIUS / 2, isCoarse);
        context.stroke();
      }
      if (goal) {
        this.drawLink(context, start, goal, agent === chosen ? 1 : 0.3);
        context.lineWidth = LINE;
        context.beginPath();
        addDisc(context, goal[1] + 0.5, goal[0] + 0.5, RADIUS, isCoarse);
        context.stroke();
      }
      context.beginPath();
      addDisc(context, start[1] + 0.5, start[0] + 0.5, RADIUS, isCoarse);
      context.fill();
      if (flagged.has(agent)) this.drawFlag(context, goal ?? start);
    });
    if (view.scale < NUMBERS_FROM) return;
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.font = "600 0.36px system-ui, sans-serif";
    grid.agents.forEach(({ start, goal }, agent) => {
      context.fillStyle = INK[agent % PALETTE.length];
      context.fillText(String(agent), start[1] + 0.5, start[0] + 0.53);
      context.fillStyle = theme.text;
      if (goal) context.fillText(String(agent), goal[1] + 0.5, goal[0] + 0.53);
    });
  }

  drawLink(context, start, goal, alpha) {
    context.globalAlpha = alpha;
    context.lineWidth = Math.max(0.05, 1 / this.view.scale);
    context.setLineDash([0.2, 0.2]);
    context.beginPath();
    context.moveTo(start[1] + 0.5, start[0] + 0.5);
    context.lineTo(goal[1] + 0.5, goal[0] + 0.5);
    context.stroke();
    context.setLineDash([]);
    context.globalAlpha = 1;
  }

  drawFlag(context, [row, col]) {
    context.strokeStyle = theme.bad;
    context.lineWidth = Math.max(0.08, 2 / this.view.scale);
    context.beginPath();
    context.arc(col + 0.5, row + 0.5, Math.max(0.47, 6 / this.view.scale), 0, 2 * Math.PI);
    context.stroke();
  }

  drawBox(context, [[oneRow, oneCol], [otherRow, otherCol]]) {
    const [row, col] = [Math.min(oneRow, otherRow), Math.min(oneCol, otherCol)];
    context.strokeStyle = theme.accent;
    context.lineWidth = Math.max(0.06, 2 / this.view.scale);
    context.strokeRect(col, row, Math.abs(oneCol - otherCol) + 1, Math.abs(oneRow - otherRow) + 1);
  }
}
