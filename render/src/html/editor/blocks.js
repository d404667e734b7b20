// The blocks of a config in YAML or JSON: a top-level field with its lines, or the lines between two fields.

const IS_IDLE = /^\s*(#.*)?$/;

const withoutComment = (line) => line.replace(/(^|\s)#.*$/, "");

const valueOf = (block) => block.lines[0].slice(block.column - 1).trim();
const isNull = (block) => block.lines.length === 1 && /^(null|~|)\s*(#.*)?$/.test(valueOf(block));

// Returns the value of a field whose value is a single word, without quotes.
function scalarOf(block) {
  const words = [valueOf(block), ...block.lines.slice(1)].map((line) => withoutComment(line).trim());
  return words.join(" ").trim().replace(/^(["'])(.*)\1$/, "$2");
}

function checkTab(line, number) {
  const tab = /^ *\t/.exec(line);
  if (tab) throw new ParseError(number, tab[0].length, "unexpected tab, expected spaces at the beginning of the line");
}

// Follows the value of a field through its lines. It knows enough of YAML to find the end of the value.
class Value {
  // `from` is the index of the value in its first line.
  constructor(line, number, from) {
    // Open brackets and quotes with their positions; the indentation of the lines after the first.
    Object.assign(this, { open: [], indent: null, isDone: false });
    const text = line.slice(from);
    if (IS_IDLE.test(text)) this.kind = "nested";
    else if (/^[|>]/.test(text)) this.beginText(text, number, from);
    else if (/^[[{"']/.test(text)) this.beginEnclosed(line, number, from);
    else if (/^[&*!%@`]/.test(text)) this.kind = "nested";
    else this.beginPlain(text, number, from);
  }

  beginText(text, number, from) {
    this.kind = "text";
    const header = /^[|>][-+]?([1-9])?[-+]?\s*(\s#.*)?$/.exec(text);
    if (!header) throw new ParseError(number, from + 2, `expected the end of the line after \`${text[0]}\``);
    if (header[1]) this.indent = Number(header[1]);
  }

  beginEnclosed(line, number, from) {
    this.kind = "enclosed";
    this.scan(line, number, from);
  }

  beginPlain(text, number, from) {
    this.kind = "plain";
    const nested = withoutComment(text).search(/:(\s|$)/);
    if (nested >= 0) throw new ParseError(number, from + nested + 1, 'unexpected ":", expected quotes around the value');
    // A comment ends a value without quotes.
    this.isDone = /\s#/.test(text);
  }

  // Reads brackets and quotes until all are closed.
  scan(line, number, from) {
    for (let at = from; at < line.length; at += 1) {
      const character = line[at];
      const last = this.open.at(-1)?.mark;
      const isAfterSpace = at === from || /[\s[{,:]/.test(line[at - 1]);
      if (last === '"' || last === "'") {
        if (last === "'" ? line.startsWith("''", at) : character === "\\") at += 1;
        else if (character === last) this.open.pop();
      } else if (character === "#" && isAfterSpace) {
        return;
      } else if ("[{".includes(character) || (`"'`.includes(character) && isAfterSpace)) {
        this.open.push({ mark: character, line: number, column: at + 1 });
      } else if ("]}".includes(character)) {
        const expected = this.open.pop().mark === "[" ? "]" : "}";
        if (character !== expected) throw new ParseError(number, at + 1, `unexpected "${character}", expected "${expected}"`);
      }
      if (this.open.length > 0) continue;
      const rest = line.slice(at + 1);
      if (this.kind === "enclosed" && !/^\s*$|^\s+#/.test(rest)) {
        throw new ParseError(number, at + 2, "expected the end of the line after the value");
      }
      this.isDone = this.kind === "enclosed";
      return;
    }
  }

  // Returns whether a line belongs to the value. If it is blank or a comment, later lines may still belong to the value.
  takes(line, number) {
    const indent = line.search(/[^ ]|$/);
    if (this.open.length > 0) return this.takesEnclosed(line, number, indent);
    if (this.isDone || line.trim() === "") return false;
    if (this.kind === "text") {
      this.indent ??= indent;
      this.isDone = indent === 0 || indent < this.indent;
      return !this.isDone;
    }
    if (IS_IDLE.test(line)) {
      this.isDone = this.kind === "plain";
      return false;
    }
    checkTab(line, number);
    if (this.kind === "nested") {
      this.indent ??= indent;
      if (indent < this.indent || (indent === 0 && !/^-(\s|$)/.test(line))) return false;
      this.scanItem(line, number);
      return true;
    }
    this.isDone = /\s#/.test(line);
    return indent > 0 && !/:(\s|$)/.test(line);
  }

  takesEnclosed(line, number, indent) {
    const isInQuotes = /["']/.test(this.open.at(-1).mark);
    if (!isInQuotes) checkTab(line, number);
    const mayBegin = isInQuotes ? line === "" : IS_IDLE.test(line) || /^[\]}]/.test(line);
    if (indent === 0 && !mayBegin) return false;
    this.scan(line, number, 0);
    return true;
  }

  // Reads an item in brackets or quotes, which can span several lines.
  scanItem(line, number) {
    const from = /^\s*(-\s+)*(\w+\s*:\s+)?/.exec(line)[0].length;
    if (/[[{"']/.test(line[from] ?? "")) this.scan(line, number, from);
  }

  // Reports the first bracket or quote that is never closed.
  close() {
    if (this.open.length === 0) return;
    const { mark, line, column } = this.open[0];
    throw new ParseError(line, column, `\`${mark}\` is never closed`);
  }
}

class Splitter {
  constructor() {
    // `idle` are the last lines that are blank or comments. They belong to the value if it continues after them.
    Object.assign(this, { blocks: [], idle: [], value: null, names: new Set(), hasBegun: false, hasEnded: false });
  }

  add(line, number) {
    if (this.value?.takes(line, number)) {
      this.blocks.at(-1).lines.push(...this.idle, line);
      this.idle = [];
      return;
    }
    this.value?.close();
    if (IS_IDLE.test(line) && !/^ *\t/.test(line)) this.idle.push(line);
    else this.begin(line, number);
  }

  // Begins a block with a line that does not belong to the previous block.
  begin(line, number) {
    const fail = (reason) => {
      throw new ParseError(number, line.search(/\S|$/) + 1, reason);
    };
    checkTab(line, number);
    if (/^(---|\.\.\.|%.*)\s*(#.*)?$/.test(line)) return this.addMarker(line, number, fail);
    const field = /^(?:([A-Za-z_]\w*)|"([^"]*)"|'([^']*)')\s*:(?=\s|$)/.exec(line);
    if (!field) fail("expected a comment or a field such as map:");
    if (this.hasEnded) fail("found a second document, expected one");
    const name = field[1] ?? field[2] ?? field[3];
    if (this.names.has(name)) fail(`duplicate key "${name}"`);
    this.names.add(name);
    this.flushIdle();
    const from = field[0].length;
    this.blocks.push({ name, line: number, column: from + 1, lines: [line] });
    this.value = new Value(line, number, from + line.slice(from).search(/\S|$/));
  }

  // Adds a directive, or the marker at the beginning or the end of the document.
  addMarker(line, number, fail) {
    const isEnd = line.startsWith("...");
    if (!isEnd && (this.hasBegun || this.names.size > 0)) fail("found a second document, expected one");
    this.flushIdle();
    this.hasBegun ||= line.startsWith("---");
    this.hasEnded ||= isEnd;
    this.value = null;
    this.blocks.push({ name: null, line: number, lines: [line], isEnd });
  }

  // Makes a block of the idle lines. They do not belong to the current value.
  flushIdle() {
    if (this.idle.length > 0) this.blocks.push({ name: null, lines: this.idle });
    this.idle = [];
  }

  close() {
    this.value?.close();
    this.flushIdle();
  }
}

// Splits a config in YAML into blocks.
function splitConfig(text) {
  const splitter = new Splitter();
  const lines = text.replace(/^\uFEFF/, "").replace(/\r\n?/g, "\n").replace(/\n$/, "").split("\n");
  lines.forEach((line, index) => splitter.add(line, index + 1));
  splitter.close();
  return splitter.blocks;
}

// Returns the line and the column of a character.
function positionAt(text, index) {
  const lines = text.slice(0, index).split("\n");
  return [lines.length, lines.at(-1).length + 1];
}

// Returns the position of a JSON error. The wording of its message depends on the browser.
function positionInJson(text, message) {
  const found = /line (\d+) column (\d+)/.exec(message);
  return found ? [Number(found[1]), Number(found[2])] : positionAt(text, Number(/position (\d+)/.exec(message)?.[1] ?? 0));
}

// Rejects JSON in which a field of the config occurs twice. JavaScript would keep the last value.
function checkNames(text) {
  const names = new Set();
  let depth = 0;
  const tokens = [...text.matchAll(/"(?:[^"\\]|\\.)*"|[[\]{}:]/g)];
  tokens.forEach(({ 0: token, index }, at) => {
    if ("[{".includes(token)) depth += 1;
    if ("]}".includes(token)) depth -= 1;
    if (depth !== 1 || tokens[at + 1]?.[0] !== ":" || token[0] !== '"') return;
    const name = JSON.parse(token);
    if (names.has(name)) throw new ParseError(...positionAt(text, index), `duplicate key "${name}"`);
    names.add(name);
  });
}

// Splits a JSON config into blocks. A map in text becomes a YAML block; every other field becomes a line of YAML, in
// which JSON values are valid.
function blocksOfJson(text) {
  let object = null;
  try {
    object = JSON.parse(text);
  } catch (error) {
    const reason = "invalid JSON; a config in braces must be JSON, because this page does not read YAML in braces";
    throw new ParseError(...positionInJson(text, error.message), reason);
  }
  checkNames(text);
  // JavaScript numbers are exact up to 2⁵³, but seeds go up to 2⁶³.
  const isExact = (value) =>
    value instanceof Object ? Object.values(value).every(isExact) : !Number.isInteger(value) || Number.isSafeInteger(value);
  return Object.entries(object).map(([name, value]) => {
    if (!isExact(value)) {
      throw new ParseError(1, 1, `${name} has too many digits to be read exactly from JSON, expected a config in YAML`);
    }
    const isText = name === "map" && typeof value === "string";
    const lines = isText ? ["map: |-", ...value.split(/\s+/).filter(Boolean).map((row) => `  ${row}`)] : null;
    return { name, line: 1, column: name.length + 2, lines: lines ?? [`${name}: ${JSON.stringify(value)}`] };
  });
}
