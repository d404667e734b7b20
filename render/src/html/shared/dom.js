// Small helpers for the document.

const byId = (id) => document.getElementById(id);

// An element with properties and children; texts become text nodes, so nothing is ever read as HTML.
function make(name, properties = {}, ...children) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(properties)) {
    if (key.startsWith("aria-") || key === "role") element.setAttribute(key, value);
    else element[key] = value;
  }
  element.append(...children);
  return element;
}

// Writes a text only where it differs: playing would otherwise lay out the page at every frame.
function tell(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

const clamp = (number, least, most) => Math.min(Math.max(number, least), most);

const count = (number, one, many = `${one}s`) => `${number.toLocaleString("en")} ${number === 1 ? one : many}`;

// A cell as it is written everywhere, row first.
const place = ([row, col]) => `(${row}, ${col})`;

// Whether a key belongs to the element that has the focus, and is no command to the page.
function isTyping(event) {
  const target = event.target;
  if (event.ctrlKey || event.metaKey || event.altKey) return true;
  if (target instanceof HTMLInputElement) return target.type !== "range" && target.type !== "checkbox";
  return target instanceof HTMLTextAreaElement || target instanceof HTMLSelectElement;
}

// Space and enter press the button that has the focus.
const isPressing = (event) =>
  (event.key === " " || event.key === "Enter") && event.target.matches("button, a, summary, input[type=checkbox]");

// Opens and closes the help, which is a dialog, so that escape closes it and the focus comes back.
function wireHelp() {
  const dialog = byId("help");
  byId("help-open").addEventListener("click", () => dialog.showModal());
  byId("help-close").addEventListener("click", () => dialog.close());
  dialog.addEventListener("click", (event) => {
    if (event.target === dialog) dialog.close();
  });
  return { toggle: () => (dialog.open ? dialog.close() : dialog.showModal()), isOpen: () => dialog.open };
}
