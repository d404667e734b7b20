// Colours and the map.

// POGEMA's seven colours first; the later colours were chosen to be far from those before them.
const PALETTE = [
  "#c1433c", "#2e6f9e", "#6e81af", "#00b9c8", "#72d5c8", "#0ea08c", "#8f7b66",
  "#fca800", "#fc90f0", "#903090", "#007800", "#90b40c", "#fc7878",
  "#cc60b4", "#a890fc", "#249cfc", "#845400", "#cc8418", "#6c9024",
  "#6c54c0", "#e4a8b4", "#90c0fc", "#00cc84", "#84546c",
];
const colorOf = (agent) => PALETTE[agent % PALETTE.length];
// Returns the red, green and blue channels of a colour such as `#c1433c`.
const channelsOf = (color) => [1, 3, 5].map((at) => parseInt(color.slice(at, at + 2), 16));
// The text colour, dark or light, that is more readable on each colour.
const INK = PALETTE.map((color) => {
  const [red, green, blue] = channelsOf(color);
  return 0.299 * red + 0.587 * green + 0.114 * blue > 150 ? "#14171a" : "#ffffff";
});

// POGEMA's proportions: of a cell 100 wide, circles have radius 35 and lines are 10 wide.
const RADIUS = 0.35;
const LINE = 0.1;
// Below this scale, circles and round corners are invisible. Units: pixels per cell.
const COARSE = 6;
// From this scale on, agents and goals have numbers. Units: pixels per cell.
const NUMBERS_FROM = 20;

// The colours of the style sheet, read again when the colour scheme changes.
const theme = {};
function readTheme() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["ground", "floor", "obstacle", "text", "soft", "line", "accent", "bad", "good"]) {
    theme[name] = style.getPropertyValue(`--${name}`).trim();
  }
}
function watchTheme(onChange) {
  readTheme();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    readTheme();
    onChange();
  });
}

// Draws the map with one pixel per cell, for small scales.
function bitmapOf(isObstacle, height, width) {
  const canvas = make("canvas", { width, height });
  const context = canvas.getContext("2d");
  const image = context.createImageData(width, height);
  const [red, green, blue] = channelsOf(theme.obstacle);
  for (let index = 0; index < height * width; index += 1) {
    if (isObstacle[index]) image.data.set([red, green, blue, 255], 4 * index);
  }
  context.putImageData(image, 0, 0);
  return canvas;
}

function paintMap(context, view, isObstacle, bitmap) {
  const { height, width, scale } = view;
  const wall = Math.max(0.12, 1.5 / scale);
  context.fillStyle = theme.floor;
  context.fillRect(0, 0, width, height);
  context.strokeStyle = theme.obstacle;
  context.lineWidth = wall;
  context.strokeRect(-wall / 2, -wall / 2, width + wall, height + wall);
  if (scale < 2 * COARSE) {
    context.imageSmoothingEnabled = scale < 1;
    // At small scales, agents among opaque obstacles would be hard to see.
    context.globalAlpha = scale < COARSE ? 0.6 : 1;
    context.drawImage(bitmap(), 0, 0);
    context.globalAlpha = 1;
    return;
  }
  const [top, bottom, left, right] = view.seen();
  paintGrid(context, view);
  context.fillStyle = theme.obstacle;
  context.beginPath();
  for (let row = top; row <= bottom; row += 1) {
    for (let col = left; col <= right; col += 1) {
      if (isObstacle[row * width + col]) context.roundRect(col + 0.05, row + 0.05, 0.9, 0.9, 0.15);
    }
  }
  context.fill();
}

function paintGrid(context, view) {
  const [top, bottom, left, right] = view.seen();
  context.strokeStyle = theme.line;
  context.lineWidth = 1 / view.scale;
  context.beginPath();
  for (let row = Math.max(1, top); row <= bottom; row += 1) {
    context.moveTo(left, row);
    context.lineTo(right + 1, row);
  }
  for (let col = Math.max(1, left); col <= right; col += 1) {
    context.moveTo(col, top);
    context.lineTo(col, bottom + 1);
  }
  context.stroke();
}

// Adds a disc or, at small scales, a square, which is much faster to draw.
function addDisc(context, x, y, radius, isCoarse) {
  if (isCoarse) {
    context.rect(x - radius, y - radius, 2 * radius, 2 * radius);
  } else {
    context.moveTo(x + radius, y);
    context.arc(x, y, radius, 0, 2 * Math.PI);
  }
}
