// Checks an implementation against the test vectors beside this file:   node check.mjs PORT.mjs
//
// PORT.mjs exports `answer(question)`, which returns the answer to a question, as conformance/ports/template.mjs does.
// Exits with 1 if an answer is wrong or no vector was checked. Needs Node 18 or newer and nothing else. In a question, an
// integer beyond 2^53 - 1, such as a large seed, is a BigInt, because a number would round it.

import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const OPTIONAL = ["on_goal", "occupied", "padded", "derived", "foretold", "actions_after"]; // if the port tells them
const WINDOWS = ["observations", "obstacles", "agents"];

// Reads JSON, with BigInts for the integers that a number would round.
function parse(text) {
  const tokens = /"(?:[^"\\]|\\.)*"|-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?/g;
  const isRounded = (token) => /^-?\d+$/.test(token) && !Number.isSafeInteger(Number(token));
  const marked = text.replace(tokens, (token) => (isRounded(token) ? `"BigInt ${token}"` : token));
  const isMarked = (value) => typeof value === "string" && value.startsWith("BigInt ");
  return JSON.parse(marked, (_, value) => (isMarked(value) ? BigInt(value.slice(7)) : value));
}

// Returns whether a port claims all that a vector needs. Observation types matter only to the profile `observations`.
function canPlay(claims, needs) {
  const defaults = { occupancy: ["as_released"], reward: ["own"] };
  return Object.entries(needs).every(([key, need]) => {
    if (key === "observation" && !claims.profiles.includes("observations")) return true;
    const claim = claims[key] ?? defaults[key];
    if (Array.isArray(need)) return need.every((word) => claim?.includes(word));
    return typeof need === "boolean" ? claim || !need : claim === undefined || claim >= need;
  });
}

// Returns the part of an expected answer that a port with these claims gives.
function compared(claims, answer) {
  const kept = structuredClone(answer);
  delete kept.error;
  for (const key of OPTIONAL) if (!claims.tells?.includes(key)) delete kept[key];
  for (const key of ["observations", "metrics"]) if (!claims.profiles.includes(key)) delete kept[key];
  for (const name in kept.metrics ?? {}) if (!claims.metrics?.includes(name)) delete kept.metrics[name];
  if (kept.metrics && Object.keys(kept.metrics).length === 0) delete kept.metrics;
  return kept;
}

// Returns the values of a window, given as hexadecimal digits or as nested lists, as `0` and `1`.
function bits(window) {
  if (typeof window === "string") {
    return [...window].map((digit) => parseInt(digit, 16).toString(2).padStart(4, "0")).join("");
  }
  const values = [window].flat(Infinity).map(Number);
  return values.join("") + "0".repeat((8 - (values.length % 8)) % 8);
}

// Compares an expected value with that of an answer.
function isSame(key, expected, got) {
  if (Array.isArray(expected)) {
    if (!Array.isArray(got) || got.length !== expected.length) return false;
    return expected.every((one, index) =>
      WINDOWS.includes(key) ? bits(one) === bits(got[index]) : isSame("", one, got[index]));
  }
  if (expected !== null && typeof expected === "object") {
    const holds = (name) => isSame(name, expected[name], got[name] ?? null);
    return got instanceof Object && Object.keys(expected).every(holds);
  }
  if (typeof expected === "number" && typeof got === "number") {
    return Math.abs(expected - got) <= 1e-9 * Math.max(1, Math.abs(expected));
  }
  return expected === got;
}

// Plays a vector and describes the first wrong answer; undefined if there is none.
function firstDifference(answer, claims, exchanges) {
  for (const [number, { question, answer: expected }] of exchanges.entries()) {
    const got = JSON.parse(JSON.stringify(answer(question)));
    if ("error" in got !== "error" in expected) {
      return `answer ${number} has \`error\` ${got.error}, expected ${expected.error}`;
    }
    for (const [key, value] of Object.entries(compared(claims, expected))) {
      if (!isSame(key, value, got[key] ?? null)) {
        return `answer ${number} has \`${key}\` ${JSON.stringify(got[key])}, expected ${JSON.stringify(value)}`;
      }
    }
  }
}

if (process.argv.length !== 3) throw new Error("usage: node check.mjs PORT.mjs");
const { answer } = await import(pathToFileURL(process.argv[2]));
const claims = answer({ type: "hello", protocol: "pogema-conform/1" });
const read = (path) => readFileSync(new URL(path, import.meta.url));
const counts = { passed: 0, failed: 0, "not played": 0 };
for (const { path, rule, sha256 } of JSON.parse(read("manifest.json")).files) {
  const text = read(path);
  if (createHash("sha256").update(text).digest("hex") !== sha256) throw new Error(`${path} was changed`);
  for (const { name, needs, pogema, exchanges } of parse(text.toString()).vectors) {
    if (pogema || !canPlay(claims, needs)) {
      counts["not played"] += 1;
      continue;
    }
    const wrong = firstDifference(answer, claims, exchanges);
    counts[wrong ? "failed" : "passed"] += 1;
    if (wrong) console.log(`${rule}: ${name}: ${wrong}`);
  }
}
console.log(Object.entries(counts).map(([what, number]) => `${number} ${what}`).join(", "));
process.exitCode = counts.failed || !counts.passed ? 1 : 0;
