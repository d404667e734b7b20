// Connects the parts of the page.

async function start() {
  const header = JSON.parse(byId("data").textContent);
  if (typeof DecompressionStream === "undefined") {
    throw new Error("this browser is too old: it has no DecompressionStream");
  }
  new Page(await unpack(header));
}

class Page {
  constructor(episode) {
    this.episode = episode;
    this.chosen = null;
    this.isGroundOld = true;
    watchTheme(() => this.redraw());
    const stage = byId("stage");
    const canvases = [byId("ground"), byId("actors")];
    this.player = new Player(episode.numSteps, (time) => this.draw(time), () => this.stopped());
    this.view = new View(stage, canvases, episode.height, episode.width, () => this.redraw());
    this.scene = new Scene(episode, this.view, ...canvases);
    this.panel = new Panel(episode, (agent) => this.select(agent), (step) => this.jump(step));
    this.timeline = new Timeline(episode, byId("scrub"), byId("strip"));
    this.view.listen({ click: (x, y) => this.select(this.scene.agentAt(x, y)) });
    this.help = wireHelp();
    this.showFacts();
    this.wire();
    addEventListener("keydown", (event) => this.key(event));
    addEventListener("hashchange", () => this.readAddress());
    document.addEventListener("visibilitychange", () => document.hidden && this.writeAddress());
    this.readAddress();
    this.expose();
    this.redraw();
    document.body.classList.add("ready");
  }

  showFacts() {
    const { episode } = this;
    const { collision, on_goal, radius } = episode.config;
    const size = `${episode.height} × ${episode.width}`;
    const counts = [count(episode.numAgents, "agent"), count(episode.numSteps, "step")];
    const facts = [size, ...counts, collision, on_goal, `radius ${radius}`];
    setText(byId("facts"), facts.join(" · "));
    const figures = Object.entries(episode.metrics).map(([name, value]) => `${name} ${number(value)}`);
    setText(byId("metrics"), figures.map((figure) => ` · ${figure}`).join(""));
  }

  wire() {
    const { player, view } = this;
    const press = (id, action) => byId(id).addEventListener("click", action);
    press("play", () => this.toggle());
    press("first", () => this.jump(0));
    press("back", () => player.move(-1));
    press("next", () => player.move(1));
    press("last", () => this.jump(this.episode.numSteps));
    press("zoom-in", () => view.zoom(1.5));
    press("zoom-out", () => view.zoom(1 / 1.5));
    press("fit", () => view.fit());
    byId("scrub").addEventListener("input", () => this.jump(Number(byId("scrub").value)));
    byId("speed").addEventListener("change", () => (player.speed = Number(byId("speed").value)));
    player.speed = Number(byId("speed").value);
    // Browsers restore the controls of a page that is loaded again.
    player.isSmooth = byId("smooth").checked;
    for (const id of ["goals", "numbers", "smooth"]) {
      byId(id).addEventListener("change", () => {
        player.isSmooth = byId("smooth").checked;
        this.redraw();
      });
    }
  }

  key(event) {
    if (isTyping(event) || isPressing(event)) return;
    const { player, view, episode } = this;
    if (this.help.isOpen() && event.key !== "?") return;
    const tick = (id) => byId(id).click();
    const actions = {
      " ": () => this.toggle(),
      ArrowLeft: () => player.move(event.shiftKey ? -10 : -1),
      ArrowRight: () => player.move(event.shiftKey ? 10 : 1),
      Home: () => this.jump(0),
      End: () => this.jump(episode.numSteps),
      "+": () => view.zoom(1.5),
      "=": () => view.zoom(1.5),
      "-": () => view.zoom(1 / 1.5),
      f: () => view.fit(),
      g: () => tick("goals"),
      n: () => tick("numbers"),
      "[": () => this.cycleAgent(-1),
      "]": () => this.cycleAgent(1),
      ",": () => this.changeSpeed(-1),
      ".": () => this.changeSpeed(1),
      "/": () => byId("search").focus(),
      "?": () => this.help.toggle(),
      Escape: () => this.select(null),
    };
    if (!Object.hasOwn(actions, event.key)) return;
    event.preventDefault();
    actions[event.key]();
  }

  toggle() {
    this.player.toggle();
    this.updatePlayButton();
  }

  updatePlayButton() {
    const { isPlaying } = this.player;
    byId("play").setAttribute("aria-label", isPlaying ? "pause" : "play");
    byId("play").classList.toggle("playing", isPlaying);
  }

  jump(step) {
    this.player.jump(step);
  }

  cycleAgent(by) {
    const { numAgents } = this.episode;
    const from = this.chosen ?? (by > 0 ? -1 : 0);
    this.select((from + by + numAgents) % numAgents);
  }

  changeSpeed(by) {
    const speed = byId("speed");
    speed.selectedIndex = clamp(speed.selectedIndex + by, 0, speed.options.length - 1);
    this.player.speed = Number(speed.value);
  }

  select(agent) {
    this.chosen = agent;
    this.panel.select(agent);
    if (agent !== null) this.view.show(...this.episode.agent(this.player.step, agent).cell);
    this.player.requestDraw();
    this.updateAddress();
  }

  stopped() {
    this.updatePlayButton();
    this.updateAddress();
    setText(byId("spoken"), `step ${this.player.step} of ${this.episode.numSteps}`);
  }

  // Writes the step and the agent into the address soon, so that readers can share it. Browsers reject more than a few
  // writes per second, but dragging the slider would cause more.
  updateAddress() {
    clearTimeout(this.addressTimer);
    this.addressTimer = setTimeout(() => this.writeAddress(), 200);
  }

  writeAddress() {
    if (!this.addressTimer) return;
    clearTimeout(this.addressTimer);
    this.addressTimer = null;
    const agent = this.chosen === null ? "" : `&agent=${this.chosen}`;
    const hash = `#step=${this.player.step}${agent}`;
    if (hash !== location.hash) history.replaceState(null, "", hash);
  }

  // Shows the step and the agent of the address; ignores invalid numbers.
  readAddress() {
    const fields = new URLSearchParams(location.hash.slice(1));
    const read = (name, most) => {
      const text = fields.get(name) ?? "";
      return /^\d{1,9}$/.test(text) && Number(text) <= most ? Number(text) : null;
    };
    const step = read("step", this.episode.numSteps);
    const agent = read("agent", this.episode.numAgents - 1);
    if (step !== null) this.player.time = step;
    if (step !== null || agent !== null) this.select(agent);
  }

  redraw() {
    this.isGroundOld = true;
    this.timeline?.drawStrip();
    this.player.requestDraw();
  }

  draw(time) {
    if (this.isGroundOld) this.scene.drawGround();
    this.isGroundOld = false;
    const options = { goals: byId("goals").checked, numbers: byId("numbers").checked };
    this.scene.drawActors(time, this.chosen, options);
    this.panel.draw(this.player.step);
    this.timeline.draw(this.player.step);
  }

  // A read-only interface for tests and scripts.
  expose() {
    const { episode, player, view } = this;
    const page = this;
    window.replay = Object.freeze({
      get step() { return player.step; },
      get isPlaying() { return player.isPlaying; },
      get agent() { return page.chosen; },
      get scale() { return view.scale; },
      get numDraws() { return player.numDraws; },
      get medianDraw() { return player.medianDraw(); },
      numSteps: episode.numSteps,
      numAgents: episode.numAgents,
      state: (step, agent) => episode.agent(step, agent),
      observe: (step, agent) => episode.observe(step, agent),
      arrivals: (step) => episode.stepArrivals[step],
      marks: (step) => episode.marks(step).reduce((cells, mark, index) => (mark ? [...cells, index] : cells), []),
      // The centre of a cell on the stage. Units: pixels.
      center: (row, col) => view.center(row, col),
    });
  }
}

start().catch((error) => {
  const reason = error instanceof Error ? error.message : String(error);
  byId("broken").hidden = false;
  setText(byId("broken"), `This episode cannot be shown: ${reason}`);
});
