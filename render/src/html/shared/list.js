// A list of any length that keeps only its visible rows in the document.

class LongList {
  // `fill(row, index)` writes one row; `choose(index)` is called when a row is selected.
  constructor(box, label, fill, choose) {
    Object.assign(this, { box, fill, choose, length: 0, chosen: -1, rows: new Map() });
    this.rowHeight = 30;
    this.spacer = make("div", { className: "spacer" });
    box.setAttribute("role", "listbox");
    box.setAttribute("aria-label", label);
    box.tabIndex = 0;
    box.append(this.spacer);
    box.addEventListener("scroll", () => this.show());
    // Find the row by position, not by element: if the rows move between press and release, the elements differ.
    box.addEventListener("click", (event) => {
      const index = Math.floor((event.clientY - this.spacer.getBoundingClientRect().top) / this.rowHeight);
      if (index >= 0 && index < this.length) choose(index);
    });
    box.addEventListener("keydown", (event) => this.key(event));
    new ResizeObserver(() => this.show()).observe(box);
  }

  set(length, chosen) {
    this.length = length;
    this.spacer.style.height = this.box.style.maxHeight = `${length * this.rowHeight}px`;
    this.box.parentElement.style.setProperty("--rows", this.spacer.style.height);
    this.pick(chosen);
  }

  // Selects a row and scrolls to it.
  pick(chosen) {
    this.chosen = chosen;
    const { box, rowHeight } = this;
    const top = chosen * rowHeight;
    if (chosen >= 0 && (top < box.scrollTop || top + rowHeight > box.scrollTop + box.clientHeight)) {
      box.scrollTop = top - box.clientHeight / 2 + rowHeight / 2;
    }
    this.draw();
  }

  // Makes the visible rows again.
  draw() {
    this.rows.clear();
    this.spacer.replaceChildren();
    this.show();
  }

  // Adds the rows that became visible and removes those that are no longer visible. A visible row stays the same
  // element, because browsers drop a click if the pressed element was removed before the release.
  show() {
    const { box, rowHeight, length, rows, spacer } = this;
    const first = Math.max(0, Math.floor(box.scrollTop / rowHeight) - 1);
    const last = Math.min(length, Math.ceil((box.scrollTop + box.clientHeight) / rowHeight) + 1);
    for (const [index, row] of rows) {
      if (index >= first && index < last) continue;
      row.remove();
      rows.delete(index);
    }
    for (let index = last - 1; index >= first; index -= 1) {
      if (rows.has(index)) continue;
      const row = this.row(index);
      spacer.insertBefore(row, rows.get(index + 1) ?? null);
      rows.set(index, row);
    }
    const chosen = this.chosen >= first && this.chosen < last ? `${box.id}-${this.chosen}` : "";
    box.setAttribute("aria-activedescendant", chosen);
  }

  row(index) {
    const row = make("div", { className: "row", id: `${this.box.id}-${index}`, role: "option" });
    row.setAttribute("aria-selected", String(index === this.chosen));
    row.setAttribute("aria-setsize", String(this.length));
    row.setAttribute("aria-posinset", String(index + 1));
    row.style.top = `${index * this.rowHeight}px`;
    this.fill(row, index);
    return row;
  }

  key(event) {
    const page = Math.max(1, Math.floor(this.box.clientHeight / this.rowHeight) - 1);
    const offsets = { ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page };
    if (!(event.key in offsets) || this.length === 0) return;
    event.preventDefault();
    event.stopPropagation();
    this.choose(clamp(this.chosen + offsets[event.key], 0, this.length - 1));
  }
}
