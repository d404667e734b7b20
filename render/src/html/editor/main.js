// Connects the parts of the page.

// The longest side that the page offers. A map that is read may be longer. Units: cells.
const LONGEST_SIDE = 4096;

class Page {
  constructor() {
    this.requestDraw = oncePerFrame(() => this.draw());
    this.grid = new Grid((what) => this.changed(what));
    const { grid } = this;
    const canvases = [byId("ground"), byId("actors")];
    watchTheme(() => this.changed("cells"));
    this.view = new View(byId("stage"), canvases, grid.height, grid.width, () => this.requestDraw());
    this.canvas = new Canvas(grid, this.view, ...canvases);
    this.tools = new Tools(grid, this.view, (what) => this.changed(what));
    this.view.listen(this.tools);
    this.files = new Files(grid);
    this.help = wireHelp();
    this.wire();
    this.expose();
    this.changed("size");
    document.body.classList.add("ready");
  }

  wire() {
    const { grid, view, tools } = this;
    const press = (id, action) => byId(id).addEventListener("click", action);
    for (const button of document.querySelectorAll("[data-tool]")) {
      button.addEventListener("click", () => tools.use(button.dataset.tool));
    }
    for (const button of document.querySelectorAll("[data-kind]")) {
      button.addEventListener("click", () => this.useKind(Number(button.dataset.kind)));
    }
    press("undo", () => grid.undo());
    press("redo", () => grid.redo());
    press("zoom-in", () => view.zoom(1.5));
    press("zoom-out", () => view.zoom(1 / 1.5));
    press("fit", () => view.fit());
    press("new", () => this.resize((height, width) => this.makeNew(height, width)));
    press("resize", () => this.resize((height, width) => this.applySize(height, width)));
    byId("tint").addEventListener("change", () => this.changed("done"));
    addEventListener("keydown", (event) => this.key(event));
    addEventListener("beforeunload", (event) => {
      if (!this.files.isSaved()) event.preventDefault();
    });
  }

  useKind(kind) {
    this.tools.kind = kind;
    if (["agents", "remove", "pan"].includes(this.tools.tool)) this.tools.tool = "brush";
    this.changed();
  }

  resize(action) {
    const { grid, files } = this;
    const [height, width] = ["height", "width"].map((id) => Number(byId(id).value));
    const isSide = (side, now) => Number.isInteger(side) && side >= 1 && (side <= LONGEST_SIDE || side === now);
    if (isSide(height, grid.height) && isSide(width, grid.width)) files.showMessage(action(height, width), false);
    else files.showMessage(`rows and columns must be whole numbers from 1 to ${LONGEST_SIDE}`, true);
  }

  makeNew(height, width) {
    this.grid.load(emptyMap(height, width));
    return `new map of ${height} × ${width}`;
  }

  applySize(height, width) {
    const [numAgents, numGoals] = this.grid.resize(height, width);
    const removed = [numAgents > 0 && count(numAgents, "agent"), numGoals > 0 && count(numGoals, "later goal")].filter(Boolean);
    const loss = removed.length > 0 ? `; removed ${removed.join(" and ")} outside it` : "";
    return `resized the map to ${height} × ${width}${loss}`;
  }

  key(event) {
    const { grid, view, tools } = this;
    if (isDialogOpen() && !(this.help.isOpen() && event.key === "?")) return;
    if (tools.stroke) {
      if (event.key === "Escape") tools.cancel();
      return;
    }
    if ((event.ctrlKey || event.metaKey) && !event.altKey && !isField(event.target)) {
      const isRedo = event.key.toLowerCase() === "y" || (event.shiftKey && event.key.toLowerCase() === "z");
      if (!isRedo && event.key.toLowerCase() !== "z") return;
      event.preventDefault();
      isRedo ? grid.redo() : grid.undo();
      return;
    }
    if (isTyping(event) || isPressing(event)) return;
    const use = (tool) => () => tools.use(tool);
    const paint = (kind) => () => this.useKind(kind);
    const far = event.shiftKey ? 5 : 1;
    const actions = {
      ArrowUp: () => tools.walk(-far, 0),
      ArrowDown: () => tools.walk(far, 0),
      ArrowLeft: () => tools.walk(0, -far),
      ArrowRight: () => tools.walk(0, far),
      " ": () => tools.apply(),
      Enter: () => tools.apply(),
      Delete: () => tools.erase(),
      Backspace: () => tools.erase(),
      b: use("brush"), r: use("rectangle"), p: use("fill"), a: use("agents"), x: use("remove"), h: use("pan"),
      "#": paint(1), ".": paint(0), "@": paint(2), $: paint(3), "!": paint(4),
      "+": () => view.zoom(1.5),
      "=": () => view.zoom(1.5),
      "-": () => view.zoom(1 / 1.5),
      f: () => view.fit(),
      c: () => byId("tint").click(),
      "?": () => this.help.toggle(),
      Escape: () => this.leave(),
    };
    if (!Object.hasOwn(actions, event.key)) return;
    event.preventDefault();
    actions[event.key]();
  }

  leave() {
    this.tools.reset();
    this.requestDraw();
  }

  // Updates the page. `what` is "size", "cells", "done" (cells changed and the stroke ended) or undefined (only the
  // display changed).
  changed(what) {
    if (!this.canvas) return;
    const { grid, view, canvas } = this;
    if (what) canvas.renew();
    if (what === "size") {
      Object.assign(view, { height: grid.height, width: grid.width });
      byId("height").value = grid.height;
      byId("width").value = grid.width;
      this.tools.reset();
      view.fit();
    }
    // Finding components is too slow for every move of a stroke.
    if (what && !this.tools.stroke) this.examine();
    this.requestDraw();
  }

  examine() {
    const { grid, canvas } = this;
    const report = check(grid);
    canvas.report = report;
    canvas.tints = null;
    if (byId("tint").checked) canvas.tint(report);
    setText(byId("size"), `${count(grid.height, "row")}, ${count(grid.width, "column")}`);
    setText(byId("free"), `${report.free.toLocaleString("en")} of ${grid.cells.length.toLocaleString("en")}`);
    setText(byId("density"), report.density.toFixed(3));
    setText(byId("components"), report.number.toLocaleString("en"));
    setText(byId("num-agents"), String(grid.agents.length));
    const shown = report.issues.slice(0, 50).map((issue) => this.issue(issue));
    if (report.issues.length > 50) shown.push(make("li", {}, `and ${report.issues.length - 50} more`));
    byId("issues").replaceChildren(...shown);
    byId("no-issues").hidden = report.issues.length > 0;
  }

  issue({ agent, reason }) {
    if (agent === null) return make("li", {}, reason);
    const button = make("button", { type: "button", className: "plain" }, reason);
    button.addEventListener("click", () => {
      this.tools.chosen = agent;
      this.view.show(...this.grid.agents[agent].start);
      this.requestDraw();
    });
    return make("li", {}, button);
  }

  draw() {
    const { grid, tools } = this;
    if (!this.canvas) return;
    const { cursor, chosen, box } = tools;
    this.canvas.draw({ cursor, chosen, box, isTinted: byId("tint").checked });
    const mark = (button, isOn) => button.setAttribute("aria-pressed", String(isOn));
    for (const button of document.querySelectorAll("[data-tool]")) mark(button, button.dataset.tool === tools.tool);
    for (const button of document.querySelectorAll("[data-kind]")) mark(button, Number(button.dataset.kind) === tools.kind);
    byId("stage").dataset.tool = tools.tool;
    byId("undo").disabled = grid.past.length === 0;
    byId("redo").disabled = grid.future.length === 0;
  }

  // A read-only interface for tests and scripts.
  expose() {
    const { grid, view, canvas } = this;
    window.editor = Object.freeze({
      get rows() { return rowsOf(grid).map((row) => row.join("")); },
      get agents() { return structuredClone(grid.agents); },
      get issues() { return canvas.report.issues.map((issue) => issue.reason); },
      center: (row, col) => view.center(row, col),
    });
  }
}

new Page();
