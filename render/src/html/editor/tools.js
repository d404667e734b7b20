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
    this.begin(cell, cell, event.shiftKey ? FREE : this.kind);
    this.onChange("cells");
    return true;
  }

  // Begins a stroke from one cell to another. `held` is the dragged start or goal, as
  // { agent, part }; `placed` has the parts of that agent that were placed.
  begin(from, last, kind) {
    const { grid, tool } = this;
    this.stroke = { tool, kind, from, last, held: null, placed: new Set() };
    grid.begin();
    if (tool === "brush") grid.line(from, from, kind);
    else if (tool === "fill") grid.fill(from, kind);
    else if (tool === "rectangle") this.box = [from, last];
    else if (tool === "remove") this.remove(from);
    else this.takeAgent(from);
  }

  // If a start or first goal is on the cell, holds it for dragging; otherwise adds an agent. While an agent has no
  // goal, only its start can be held, and any other cell becomes its goal.
  takeAgent(cell) {
    const { grid, stroke } = this;
    const unfinished = grid.agents.findIndex((agent) => agent.goal === null);
    const hit = grid.agentOn(cell);
    const isHeld = hit && hit.part !== "later goal" && (unfinished < 0 || hit.agent === unfinished);
    if (isHeld) stroke.held = hit;
    else if (unfinished >= 0) this.place({ agent: unfinished, part: "goal" }, cell);
    else {
      // Dragging from the start of a new agent places its goal.
      stroke.held = { agent: grid.addAgent(cell), part: "goal" };
      stroke.placed.add("start");
    }
    this.chosen = stroke.held.agent;
  }

  // Moves the held start or goal. Obstacles under it stay until the stroke ends.
  place(held, cell) {
    this.stroke.held = held;
    this.stroke.placed.add(held.part);
    this.grid.moveAgent(held.agent, held.part, cell);
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
    if (!stroke || String(cell) === String(stroke.last)) return;
    if (stroke.tool === "brush") grid.line(stroke.last, cell, stroke.kind);
    if (stroke.tool === "rectangle") this.box = [stroke.from, cell];
    if (stroke.tool === "agents") this.place(stroke.held, cell);
    stroke.last = cell;
    this.onChange("cells");
  }

  release() {
    const { grid, stroke } = this;
    if (!stroke) return;
    if (stroke.tool === "rectangle") grid.rectangle(stroke.from, stroke.last, stroke.kind);
    for (const part of stroke.placed) grid.clear(grid.agents[stroke.held.agent][part]);
    grid.commit();
    this.stroke = null;
    this.dropUnfinished();
    this.onChange("done");
  }

  cancel() {
    if (!this.stroke) return;
    this.stroke = null;
    this.dropUnfinished();
    this.grid.rollback();
    this.onChange("done");
  }

  // Drops everything that refers to cells or agents, for example because the map has been replaced.
  reset() {
    this.stroke = this.cursor = this.chosen = null;
    this.dropUnfinished();
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
    this.begin(this.anchor ?? this.cursor, this.cursor, kind);
    this.release();
    setText(byId("spoken"), this.describe(this.cursor));
  }

  erase() {
    if (!this.cursor) return;
    this.grid.edit(() => {
      if (this.grid.agentOn(this.cursor)) this.remove(this.cursor);
      else this.grid.line(this.cursor, this.cursor, FREE);
    });
    this.onChange("done");
  }
}
