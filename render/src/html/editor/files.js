// Loads and saves files.

// Returns whether a text is a config rather than map text.
const isConfig = (name, text) =>
  /\.(ya?ml|json)$/i.test(name) || (!/\.(txt|map)$/i.test(name) && /^\s*\{|^---|^["']?[A-Za-z_]\w*["']?\s*:(\s|$)/m.test(text));

class Files {
  constructor(grid, onLoad) {
    Object.assign(this, { grid, onLoad, name: "map" });
    const picker = byId("picker");
    byId("open").addEventListener("click", () => picker.click());
    picker.addEventListener("change", () => {
      if (picker.files.length > 0) this.take(picker.files[0]);
      picker.value = "";
    });
    byId("save-text").addEventListener("click", () => this.save("txt"));
    byId("save-yaml").addEventListener("click", () => this.save("yaml"));
    this.wireDrop();
    this.wirePaste();
  }

  wireDrop() {
    const hasFile = (event) => event.dataTransfer?.types.includes("Files");
    addEventListener("dragover", (event) => {
      if (!hasFile(event)) return;
      event.preventDefault();
      document.body.classList.add("dropping");
    });
    addEventListener("dragleave", (event) => {
      if (event.relatedTarget === null) document.body.classList.remove("dropping");
    });
    addEventListener("drop", (event) => {
      document.body.classList.remove("dropping");
      if (!hasFile(event)) return;
      event.preventDefault();
      if (event.dataTransfer.files.length > 0) this.take(event.dataTransfer.files[0]);
    });
  }

  wirePaste() {
    const [dialog, text] = [byId("source"), byId("source-text")];
    const show = (kind) => {
      text.value = this.write(kind) ?? text.value;
    };
    byId("edit-source").addEventListener("click", () => {
      setText(byId("source-error"), "");
      show(this.grid.agents.length > 0 || this.grid.blocks.length > 0 ? "yaml" : "txt");
      dialog.showModal();
    });
    byId("source-as-text").addEventListener("click", () => show("txt"));
    byId("source-as-yaml").addEventListener("click", () => show("yaml"));
    byId("source-close").addEventListener("click", () => dialog.close());
    byId("source-load").addEventListener("click", () => {
      if (this.read("pasted", text.value)) return dialog.close();
      setText(byId("source-error"), byId("message").textContent);
      this.pointAt(text);
    });
    // Pasting anywhere else loads the pasted text.
    addEventListener("paste", (event) => {
      if (event.target.closest("textarea, input")) return;
      const pasted = event.clipboardData.getData("text/plain");
      if (pasted.trim() !== "") this.read("pasted", pasted);
    });
  }

  // Selects the character of the last error.
  pointAt(text) {
    if (!this.lastError) return;
    const before = text.value.split("\n").slice(0, this.lastError.line - 1).reduce((sum, line) => sum + line.length + 1, 0);
    text.focus();
    text.setSelectionRange(before + this.lastError.column - 1, before + this.lastError.column);
  }

  // Loads a file. If several files are read at the same time, only the last one is loaded.
  async take(file) {
    this.loading = file;
    document.body.setAttribute("aria-busy", "true");
    const text = await file.text().catch(() => null);
    if (this.loading !== file) return;
    document.body.removeAttribute("aria-busy");
    if (text === null) this.showMessage(`${file.name}: cannot be read`, true);
    else this.read(file.name, text);
  }

  read(name, text) {
    this.lastError = null;
    try {
      const map = isConfig(name, text) ? parseConfig(text) : parseMapText(text);
      if (name !== "pasted") this.name = name.replace(/\.[^.]*$/, "") || "map";
      this.grid.load(map);
      const what = `${map.height} × ${map.width}, ${count(map.agents.length, "agent")}`;
      this.onLoad(`${name}: ${what}`);
      return true;
    } catch (error) {
      if (!(error instanceof ParseError)) throw error;
      this.lastError = error;
      this.showMessage(`${name}: ${error.message}`, true);
      return false;
    }
  }

  // Returns the map as text or YAML. If that is impossible, shows the reason and returns null.
  write(kind) {
    const { grid } = this;
    const unfinished = grid.agents.findIndex((agent) => agent.goal === null);
    const reason = unfinished >= 0 ? `agent ${unfinished} has no goal yet` : kind === "txt" ? unfitForText(grid) : null;
    if (reason) {
      this.showMessage(`not saved: ${reason}`, true);
      return null;
    }
    return kind === "txt" ? formatMapText(grid) : formatConfig(grid, grid.blocks);
  }

  save(kind) {
    const text = this.write(kind);
    if (text === null) return;
    const link = make("a", { href: URL.createObjectURL(new Blob([text], { type: "text/plain" })) });
    link.download = `${this.name}.${kind}`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    const isLost = kind === "txt" && hasSettings(this.grid);
    this.showMessage(`saved ${link.download}${isLost ? "; only YAML keeps the other settings of the config" : ""}`, false);
  }

  showMessage(text, isBad) {
    const message = byId("message");
    setText(message, text);
    message.classList.toggle("bad", isBad);
  }
}

const hasSettings = (grid) => grid.blocks.some(({ name }) => name !== null && !EDITED.includes(name));
