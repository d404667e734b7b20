// The part of the map that a stage shows, and the gestures that change it.

const SMALLEST_CELL = 0.25;
const LARGEST_CELL = 96;
// A press that moves at most this far is a click. Units: pixels.
const CLICK_DISTANCE = 5;

class View {
  // Cells are `scale` pixels wide, and the corner of the map is at (left, top).
  constructor(stage, canvases, height, width, onChange) {
    Object.assign(this, { stage, canvases, height, width, onChange, scale: 10, left: 0, top: 0 });
    this.isFitted = true;
    new ResizeObserver(() => this.resize()).observe(stage);
    // The ratio changes with the zoom of the browser and between screens.
    addEventListener("resize", () => this.resize());
    this.resize();
  }

  resize() {
    const { clientWidth, clientHeight } = this.stage;
    const ratio = devicePixelRatio || 1;
    const [shiftX, shiftY] = [(clientWidth - this.stageWidth) / 2, (clientHeight - this.stageHeight) / 2];
    Object.assign(this, { stageWidth: clientWidth, stageHeight: clientHeight, ratio });
    for (const canvas of this.canvases) {
      canvas.width = Math.max(1, Math.round(clientWidth * ratio));
      canvas.height = Math.max(1, Math.round(clientHeight * ratio));
    }
    if (this.isFitted) this.fit();
    else this.pan(shiftX, shiftY);
  }

  // Returns the largest scale that shows the whole map with its wall. It is positive even if the stage is hidden.
  fittingScale() {
    return Math.max(Math.min(this.stageWidth / (this.width + 2), this.stageHeight / (this.height + 2)), 1e-3);
  }

  // Shows the whole map with its wall.
  fit() {
    this.scale = Math.min(this.fittingScale(), LARGEST_CELL);
    this.left = (this.stageWidth - this.scale * this.width) / 2;
    this.top = (this.stageHeight - this.scale * this.height) / 2;
    this.isFitted = true;
    this.onChange();
  }

  pan(x, y) {
    this.left += x;
    this.top += y;
    this.keepVisible();
  }

  zoom(factor, x = this.stageWidth / 2, y = this.stageHeight / 2) {
    const scale = clamp(this.scale * factor, Math.min(SMALLEST_CELL, this.fittingScale()), LARGEST_CELL);
    this.left = x - ((x - this.left) * scale) / this.scale;
    this.top = y - ((y - this.top) * scale) / this.scale;
    this.scale = scale;
    this.keepVisible();
  }

  // Keeps a part of the map visible.
  keepVisible() {
    const margin = 40;
    this.left = clamp(this.left, margin - this.scale * this.width, this.stageWidth - margin);
    this.top = clamp(this.top, margin - this.scale * this.height, this.stageHeight - margin);
    this.isFitted = false;
    this.onChange();
  }

  // Moves the view to a cell unless the cell is visible and not near an edge.
  show(row, col) {
    const [x, y] = this.center(row, col);
    const margin = Math.min(this.stageWidth, this.stageHeight) / 8;
    const fits = (at, side) => at >= margin && at <= side - margin;
    if (fits(x, this.stageWidth) && fits(y, this.stageHeight)) return;
    this.pan(this.stageWidth / 2 - x, this.stageHeight / 2 - y);
  }

  center(row, col) {
    return [this.left + (col + 0.5) * this.scale, this.top + (row + 0.5) * this.scale];
  }

  cellAt(x, y) {
    return [Math.floor((y - this.top) / this.scale), Math.floor((x - this.left) / this.scale)];
  }

  // Returns the visible rows and columns: [first row, last row, first col, last col].
  seen() {
    const [top, left] = this.cellAt(0, 0);
    const [bottom, right] = this.cellAt(this.stageWidth, this.stageHeight);
    return [Math.max(0, top), Math.min(this.height - 1, bottom), Math.max(0, left), Math.min(this.width - 1, right)];
  }

  // Clears a canvas and returns its context, with cells as units and the corner of the map as (0, 0).
  begin(canvas) {
    const context = canvas.getContext("2d");
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, canvas.width, canvas.height);
    const { ratio, scale } = this;
    context.setTransform(ratio * scale, 0, 0, ratio * scale, ratio * this.left, ratio * this.top);
    return context;
  }

  // Handles wheel, drag and pinch. If `tool.press(x, y, event)` returns true, the tool handles the press and gets its
  // move, release and cancel; otherwise a press that does not move calls `tool.click`.
  listen(tool) {
    this.tool = tool;
    this.pointers = new Map();
    const stage = this.stage;
    const wheel = (event) => {
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 24 : 1;
      this.zoom(Math.exp(-clamp(event.deltaY * lines, -240, 240) / 400), ...this.place(event));
    };
    stage.addEventListener("wheel", wheel, { passive: false });
    stage.addEventListener("pointerdown", (event) => this.press(event));
    stage.addEventListener("pointermove", (event) => this.move(event));
    stage.addEventListener("pointerup", (event) => this.release(event, true));
    stage.addEventListener("pointercancel", (event) => this.release(event, false));
  }

  place(event) {
    const box = this.stage.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  press(event) {
    if (event.target.closest("button")) return;
    this.stage.setPointerCapture(event.pointerId);
    const [x, y] = this.place(event);
    this.pointers.set(event.pointerId, [x, y]);
    if (this.pointers.size === 1) {
      this.pressed = [x, y];
      this.isDrag = false;
      this.isPrimary = event.button === 0;
      this.isTool = event.button === 0 && Boolean(this.tool.press?.(x, y, event));
    } else if (this.isTool) {
      // A second finger makes the press a pinch, so cancel the stroke.
      this.isTool = false;
      this.tool.cancel?.();
    }
  }

  move(event) {
    const [x, y] = this.place(event);
    this.tool.hover?.(x, y);
    const last = this.pointers.get(event.pointerId);
    if (!last) return;
    const others = [...this.pointers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
    this.pointers.set(event.pointerId, [x, y]);
    if (others.length > 0) {
      this.isDrag = true;
      this.pinch(last, [x, y], others[0]);
    } else if (this.isTool) {
      this.tool.move(x, y, event);
    } else if (this.isDrag || Math.hypot(x - this.pressed[0], y - this.pressed[1]) > CLICK_DISTANCE) {
      if (!this.isDrag) this.stage.classList.add("dragging");
      this.isDrag = true;
      this.pan(x - last[0], y - last[1]);
    }
  }

  pinch(from, to, other) {
    const span = (point) => Math.max(1, Math.hypot(point[0] - other[0], point[1] - other[1]));
    this.pan((to[0] - from[0]) / 2, (to[1] - from[1]) / 2);
    this.zoom(span(to) / span(from), (to[0] + other[0]) / 2, (to[1] + other[1]) / 2);
  }

  release(event, isDone) {
    if (!this.pointers.delete(event.pointerId) || this.pointers.size > 0) return;
    this.stage.classList.remove("dragging");
    if (this.isTool) {
      this.isTool = false;
      if (isDone) this.tool.release(...this.place(event), event);
      else this.tool.cancel?.();
    } else if (isDone && this.isPrimary && !this.isDrag) {
      this.tool.click?.(...this.place(event), event);
    }
  }
}
