// The tools of the editor, used by pointer or keyboard.

class Tools {
  constructor(grid, view, onChange) {
    Object.assign(this, { grid, view, onChange, tool: "brush", kind: OBSTACLE, cursor: null, box: null });
    Object.assign(this, { chosen: null, stroke: null, anchor: null });
  }

  use(tool) {
    this.tool = tool;
    this.dropUnfinished();
    this.onChange();
  }

  // Cancels a rectangle that was started with the keyboard.
  dropUnfinished() {
    this.anchor = this.box = null;
  }

  near(x, y) {
    const [row, col] = this.view.cellAt(x, y);
    return [clamp(row, 0, this.grid.height - 1), clamp(col, 0, this.grid.width - 1)];
  }

  press(x, y, event) {
    const cell = this.view.cellAt(x, y);
    if (this.tool === "pan" || !this.grid.contains(cell)) return false;
    this.dropUnfinished();
    this.cursor = null;
    const kind = event.shiftKey ? FREE : this.kind;
    this.stroke = { from: cell, last: cell, kind };
    this.begin(cell, kind);
    this.onChange("cells");
    return true;
  }

  begin(cell, kind) {
    const { grid } = this;
    grid.remember();
    if (this.tool === "brush") grid.put(cell, kind);
    else if (this.tool === "fill") grid.fill(cell, kind);
    else if (this.tool === "rectangle") this.box = [cell, cell];
    else if (this.tool === "remove") this.remove(cell);
    else this.takeAgent(cell);
  }

  // On a start or goal, holds it for dragging. Elsewhere, sets the missing goal of an agent, or else adds an agent.
  takeAgent(cell) {
    const { grid } = this;
    const unfinished = grid.agents.findIndex((agent) => agent.goal === null);
    const hit = grid.agentOn(cell);
    if (hit && !(unfinished >= 0 && hit.agent !== unfinished)) {
      this.held = hit;
    } else if (unfinished >= 0) {
      grid.moveAgent(unfinished, "goal", cell);
      this.held = { agent: unfinished, part: "goal" };
    } else {
      this.held = { agent: grid.addAgent(cell), part: "new" };
    }
    this.chosen = this.held.agent;
  }

  remove(cell) {
    const hit = this.grid.agentOn(cell);
    if (!hit) return;
    this.grid.agents.splice(hit.agent, 1);
    this.chosen = null;
  }

  move(x, y) {
    const { grid, stroke } = this;
    const cell = this.near(x, y);
    if (String(cell) === String(stroke.last)) return;
    if (this.tool === "brush") grid.line(stroke.last, cell, stroke.kind);
    if (this.tool === "rectangle") this.box = [stroke.from, cell];
    // Dragging from the start of a new agent places its goal.
    if (this.tool === "agents") grid.moveAgent(this.held.agent, this.held.part === "start" ? "start" : "goal", cell);
    stroke.last = cell;
    this.onChange("cells");
  }

  release() {
    if (this.tool === "rectangle") this.grid.rectangle(this.stroke.from, this.stroke.last, this.stroke.kind);
    this.stroke = this.box = null;
    this.onChange("done");
  }

  cancel() {
    this.stroke = this.box = null;
    this.grid.forget();
    this.onChange("done");
  }

  hover(x, y) {
    const cell = this.view.cellAt(x, y);
    setText(byId("where"), this.grid.contains(cell) ? this.describe(cell) : "");
  }

  describe(cell) {
    const hit = this.grid.agentOn(cell);
    const names = ["free", "obstacle", "possible start", "possible goal", "neither start nor goal"];
    return `${place(cell)} ${hit ? `${hit.part} of agent ${hit.agent}` : names[this.grid.at(cell)]}`;
  }

  // Moves the keyboard cursor.
  walk(down, right) {
    const { grid, view } = this;
    if (!this.cursor) this.cursor = this.near(view.stageWidth / 2, view.stageHeight / 2);
    else this.cursor = [clamp(this.cursor[0] + down, 0, grid.height - 1), clamp(this.cursor[1] + right, 0, grid.width - 1)];
    if (this.anchor) this.box = [this.anchor, this.cursor];
    view.show(...this.cursor);
    setText(byId("where"), this.describe(this.cursor));
    setText(byId("spoken"), this.describe(this.cursor));
    this.onChange();
  }

  // Uses the tool at the cursor. A rectangle needs two calls, one for each corner.
  apply(kind = this.kind) {
    if (!this.cursor || this.tool === "pan") return;
    if (this.tool === "rectangle" && !this.anchor) {
      this.anchor = this.cursor;
      this.box = [this.anchor, this.anchor];
      this.onChange();
      return;
    }
    const anchor = this.anchor;
    this.begin(this.cursor, kind);
    if (anchor) this.grid.rectangle(anchor, this.cursor, kind);
    this.dropUnfinished();
    setText(byId("spoken"), this.describe(this.cursor));
    this.onChange("done");
  }

  erase() {
    if (!this.cursor) return;
    this.grid.remember();
    if (this.grid.agentOn(this.cursor)) this.remove(this.cursor);
    else this.grid.put(this.cursor, FREE);
    this.onChange("done");
  }
}
