// The list of agents and the details of the selected agent.

const WHY = {
  "move/actions": "an agent that aims at an obstacle or the wall stays",
  "collide/priority": "the cell was occupied",
  "collide/priority/contest": "an agent with a lower index got the cell",
  "collide/priority/follow": "an agent with a higher index had not left the cell yet",
  "collide/priority/swap": "agents that swap or form a ring stay",
  "collide/block-both": "the move was not possible",
  "collide/block-both/contest": "another agent requested the same cell",
  "collide/block-both/occupied": "the cell held an agent before the step",
  "collide/soft": "the move was not possible",
  "collide/soft/stay": "an agent that aims at an obstacle or the wall stays",
  "collide/soft/swap": "the two agents requested each other's cells",
  "collide/soft/contest": "an agent with a lower index got the cell",
  "collide/soft/chain": "the agent ahead stayed",
};

const number = (value) => String(Math.round(value * 1000) / 1000);

function describeCause({ cause, cell, other }) {
  if (cause === "agent") return `agent ${other}`;
  if (cause === "unknown") return "unknown cause";
  return cause === "wall" ? "the wall" : `obstacle ${place(cell)}`;
}

class Panel {
  // Selecting an agent calls `choose(agent)`, with null to deselect; selecting a reverted move calls `jump(step)`.
  constructor(episode, choose, jump) {
    Object.assign(this, { episode, jump, choose, chosen: null, reverted: [], shown: "" });
    this.order = Array.from({ length: episode.numAgents }, (_, agent) => agent);
    this.agents = new LongList(
      byId("agents"), "agents", (row, index) => this.fillAgent(row, index), (index) => choose(this.order[index]),
    );
    this.moves = new LongList(
      byId("moves"), "reverted moves", (row, index) => this.fillMove(row, index),
      (index) => jump(this.reverted[index].step),
    );
    byId("search").addEventListener("input", () => this.search());
    byId("search").addEventListener("keydown", (event) => {
      if (event.key === "Enter" && this.order.length > 0) choose(this.order[0]);
      if (event.key === "Escape") byId("stage").focus();
    });
    byId("order").addEventListener("change", () => this.search());
    byId("deselect").addEventListener("click", () => choose(null));
    this.search();
  }

  // Lists the agents whose number starts with the searched digits, in the selected order.
  search() {
    const { episode } = this;
    const digits = byId("search").value.trim();
    const totals = { reverted: episode.agentReverted, rewards: episode.agentRewards }[byId("order").value];
    this.order = [];
    for (let agent = 0; agent < episode.numAgents; agent += 1) {
      if (String(agent).startsWith(digits)) this.order.push(agent);
    }
    if (totals) this.order.sort((one, other) => totals[other] - totals[one] || one - other);
    setText(byId("found"), this.order.length > 0 ? "" : `no agent ${digits}, expected 0 to ${episode.numAgents - 1}`);
    this.agents.set(this.order.length, this.order.indexOf(this.chosen));
  }

  fillAgent(row, index) {
    const agent = this.order[index];
    const dot = make("span", { className: "dot" });
    dot.style.background = colorOf(agent);
    const numbers = `reward ${number(this.episode.agentRewards[agent])}, ${this.episode.agentReverted[agent]} reverted`;
    row.append(dot, make("b", {}, `agent ${agent}`), make("span", { className: "soft" }, numbers));
  }

  fillMove(row, index) {
    const move = this.reverted[index];
    row.title = WHY[move.rule] ?? "";
    row.append(
      make("b", {}, String(move.step)), make("span", {}, move.action), make("code", {}, move.rule),
      make("span", { className: "soft" }, describeCause(move)),
    );
  }

  select(agent) {
    this.chosen = agent;
    this.shown = "";
    this.agents.pick(this.order.indexOf(agent));
    byId("no-agent").hidden = agent !== null;
    byId("agent").hidden = agent === null;
    if (agent === null) return;
    byId("agent-dot").style.background = colorOf(agent);
    setText(byId("agent-name"), `Agent ${agent}`);
    this.reverted = this.episode.revertedOf(agent);
    setText(byId("moves-title"), count(this.reverted.length, "reverted move"));
    byId("moves").hidden = this.reverted.length === 0;
    this.moves.set(this.reverted.length, -1);
  }

  // Runs for every drawn frame; draws only if the step, the agent or the colour theme has changed.
  draw(step) {
    const shown = `${step} ${this.chosen} ${theme.ground}`;
    if (this.chosen === null || shown === this.shown) return;
    this.shown = shown;
    const state = this.episode.agent(step, this.chosen);
    const status = !state.isActive ? "finished" : state.isOnGoal ? "on its goal" : "on its way";
    setText(byId("agent-status"), state.isActive && !state.isMarked ? `${status}, vanished` : status);
    setText(byId("agent-cell"), place(state.cell));
    setText(byId("agent-goal"), place(state.goal));
    setText(byId("agent-action"), state.action ?? "none yet");
    setText(byId("agent-reward"), `${number(state.reward)} now, ${number(state.total)} so far`);
    const ends = [state.isTerminated && "terminated", state.isTruncated && "truncated"].filter(Boolean);
    setText(byId("agent-end"), ends.join(", ") || "no");
    const { reverted } = state;
    byId("why").hidden = !reverted;
    if (reverted) {
      setText(byId("why-rule"), reverted.rule);
      setText(byId("why-text"), `${WHY[reverted.rule] ?? ""}: ${describeCause(reverted)}`);
    }
    this.moves.pick(this.reverted.findIndex((move) => move.step === step));
    this.drawWindows(step);
  }

  drawWindows(step) {
    for (const [name, rows] of Object.entries(this.episode.observe(step, this.chosen))) {
      const canvas = byId(`channel-${name}`);
      const side = rows.length;
      // One canvas pixel per screen pixel, so that all lines between cells are equally sharp.
      const across = Math.round((canvas.clientWidth || 96) * (devicePixelRatio || 1));
      canvas.width = canvas.height = across;
      const edge = (index) => Math.round((index * across) / side);
      const gap = across / side > 5 ? 1 : 0;
      const context = canvas.getContext("2d");
      const colors = { obstacles: theme.obstacle, agents: theme.text, goal: colorOf(this.chosen) };
      context.fillStyle = theme.line;
      context.fillRect(0, 0, across, across);
      rows.forEach((row, down) => row.forEach((value, right) => {
        context.fillStyle = value ? colors[name] : theme.floor;
        const [x, y] = [edge(right), edge(down)];
        context.fillRect(x, y, Math.max(1, edge(right + 1) - x - gap), Math.max(1, edge(down + 1) - y - gap));
      }));
    }
  }
}
