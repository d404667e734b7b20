// Loads and saves files.

// Returns whether a text is a config rather than map text.
const isConfig = (name, text) =>
  /\.(ya?ml|json)$/i.test(name) || (!/\.(txt|map)$/i.test(name) && /^\s*\{|^---|^["']?[A-Za-z_]\w*["']?\s*:(\s|$)/m.test(text));

function parseAny(name, text) {
  if (/^type\s+octile\s/.test(text)) {
    const reason = "a MovingAI map, expected map text or a config; `pogema maps export MAP --to text` converts it";
    throw new ParseError(1, 1, reason);
  }
  return isConfig(name, text) ? parseConfig(text) : parseMapText(text);
}

class Files {
  constructor(grid) {
    // `saved` is the revision of the map that is in a file.
    Object.assign(this, { grid, saved: grid.revision });
    const picker = byId("picker");
    byId("open").addEventListener("click", () => picker.click());
    picker.addEventListener("change", () => {
      if (picker.files.length > 0) this.take(picker.files[0]);
      picker.value = "";
    });
    byId("save-text").addEventListener("click", () => this.save("txt"));
    byId("save-yaml").addEventListener("click", () => this.save("yaml"));
    this.wireDrop();
    this.wireSource();
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

  wireSource() {
    const [dialog, text] = [byId("source"), byId("source-text")];
    const show = (kind) => {
      const reason = this.unfitFor(kind);
      setText(byId("source-error"), reason === null ? "" : `cannot be written as ${kind === "txt" ? "text" : "YAML"}: ${reason}`);
      if (reason === null) text.value = this.write(kind);
    };
    byId("edit-source").addEventListener("click", () => {
      text.value = "";
      show(this.grid.agents.length > 0 || this.grid.blocks.length > 0 ? "yaml" : "txt");
      dialog.showModal();
    });
    byId("source-as-text").addEventListener("click", () => show("txt"));
    byId("source-as-yaml").addEventListener("click", () => show("yaml"));
    byId("source-close").addEventListener("click", () => dialog.close());
    byId("source-load").addEventListener("click", () => {
      if (this.read(text.value)) return dialog.close();
      setText(byId("source-error"), byId("message").textContent);
      this.pointAt(text);
    });
    // Pasting anywhere else loads the pasted text.
    addEventListener("paste", (event) => {
      if (isDialogOpen() || isField(event.target)) return;
      const pasted = event.clipboardData.getData("text/plain");
      if (pasted.trim() !== "") this.read(pasted);
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
    else this.read(text, file.name);
  }

  // Loads a text, and returns whether that succeeded. Without a file name, the text was pasted or is from the dialog.
  read(text, fileName = null) {
    const name = fileName ?? "pasted";
    this.lastError = null;
    try {
      const map = parseAny(name, text);
      this.grid.load(map, fileName?.replace(/\.[^.]*$/, "") || undefined);
      if (fileName !== null) this.saved = this.grid.revision;
      this.showMessage(`${name}: ${map.height} × ${map.width}, ${count(map.agents.length, "agent")}`, false);
      return true;
    } catch (error) {
      if (!(error instanceof ParseError)) throw error;
      this.lastError = error;
      this.showMessage(`${name}: ${error.message}`, true);
      return false;
    }
  }

  // Returns the reason why the map cannot be written, or null.
  unfitFor(kind) {
    const { grid } = this;
    const unfinished = grid.agents.findIndex((agent) => agent.goal === null);
    if (unfinished >= 0) return `agent ${unfinished} has no goal yet`;
    return kind === "txt" ? unfitForText(grid) : null;
  }

  // Returns the map as text or YAML. Call this only if `unfitFor` returns null.
  write(kind) {
    return kind === "txt" ? formatMapText(this.grid) : formatConfig(this.grid, this.grid.blocks);
  }

  save(kind) {
    const { grid } = this;
    const reason = this.unfitFor(kind);
    if (reason !== null) return this.showMessage(`not saved: ${reason}`, true);
    const link = make("a", { href: URL.createObjectURL(new Blob([this.write(kind)], { type: "text/plain" })) });
    link.download = `${grid.name}.${kind}`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    this.saved = grid.revision;
    const isLost = kind === "txt" && hasSettings(grid);
    this.showMessage(`saved ${link.download}${isLost ? "; only YAML keeps the other settings of the config" : ""}`, false);
  }

  // Returns whether a file holds the current map.
  isSaved() {
    return this.grid.revision === this.saved;
  }

  showMessage(text, isBad) {
    const message = byId("message");
    setText(message, text);
    message.classList.toggle("bad", isBad);
  }
}

const hasSettings = (grid) => grid.blocks.some(({ name }) => name !== null && !EDITED.includes(name));
