// Helpers for the document.

const byId = (id) => document.getElementById(id);

// Makes an element with properties and children. Strings become text nodes, so they are never parsed as HTML.
function make(name, properties = {}, ...children) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(properties)) {
    if (key.startsWith("aria-") || key === "role") element.setAttribute(key, value);
    else element[key] = value;
  }
  element.append(...children);
  return element;
}

// Sets the text of an element only if it differs, because every change triggers a layout of the page.
function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

const clamp = (number, least, most) => Math.min(Math.max(number, least), most);

const count = (number, one, many = `${one}s`) => `${number.toLocaleString("en")} ${number === 1 ? one : many}`;

// Formats a cell, row first.
const place = ([row, col]) => `(${row}, ${col})`;

// Returns whether an element takes keys as input, as a text field does.
function isField(target) {
  if (target instanceof HTMLInputElement) return target.type !== "range" && target.type !== "checkbox";
  return target instanceof HTMLTextAreaElement || target instanceof HTMLSelectElement;
}

// Returns whether a key is input to the focused element or a shortcut of the browser, and not a command of the page.
// On a Mac, some keyboards need alt (option) for characters such as `#` and `[`.
function isTyping(event) {
  const isSymbol = /^[^\p{L}\p{N}\s]$/u.test(event.key);
  return event.ctrlKey || event.metaKey || (event.altKey && !isSymbol) || isField(event.target);
}

const isDialogOpen = () => document.querySelector("dialog[open]") !== null;

// Returns whether a key presses the focused button, as space and enter do.
const isPressing = (event) =>
  (event.key === " " || event.key === "Enter") && event.target.matches("button, a, summary, input[type=checkbox]");

// Returns a function that requests a call of `draw(now)` for the next frame. Further requests before that frame have no
// effect.
function oncePerFrame(draw) {
  let isRequested = false;
  return () => {
    if (isRequested) return;
    isRequested = true;
    requestAnimationFrame((now) => {
      isRequested = false;
      draw(now);
    });
  };
}

// Connects the help. It is a dialog, so that escape closes it and restores the focus.
function wireHelp() {
  const dialog = byId("help");
  byId("help-open").addEventListener("click", () => dialog.showModal());
  byId("help-close").addEventListener("click", () => dialog.close());
  dialog.addEventListener("click", (event) => {
    if (event.target === dialog) dialog.close();
  });
  return { toggle: () => (dialog.open ? dialog.close() : dialog.showModal()), isOpen: () => dialog.open };
}
