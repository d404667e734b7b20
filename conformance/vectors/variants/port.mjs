// A port that tests the checker, selected by VARIANT. `core`, `capitals`, `letters` and `metrics` change the answers of
// the template; `seeds` refuses each question with its seed. `run` explains them.

import { answer as templateAnswer } from "../../ports/template.mjs";

const { VARIANT } = process.env;
const SEEDING = { profiles: ["core", "seeding"], collision: ["priority"], on_goal: ["finish"], observation: ["default"] };

// Returns a window as capital hexadecimal digits; with `letters`, the first character is not a digit.
function digits(window) {
  const values = window.flat(Infinity).map(Number);
  const bits = values.join("") + "0".repeat((8 - (values.length % 8)) % 8);
  const text = bits.replace(/.{4}/g, (four) => parseInt(four, 2).toString(16).toUpperCase());
  return VARIANT === "letters" ? "z" + text.slice(1) : text;
}

export function answer(question) {
  if (VARIANT === "seeds") return question.type === "hello" ? SEEDING : { error: `seed ${question.config?.seed}` };
  const given = templateAnswer(question);
  if (question.type === "hello") {
    if (VARIANT === "core") return { ...given, profiles: ["core"], observation: undefined };
    return { ...given, profiles: [...given.profiles, "metrics"], metrics: VARIANT === "metrics" ? ["ISR"] : [] };
  }
  if (VARIANT === "metrics" && "rewards" in given) given.metrics = { ISR: 0.5 };
  if (["capitals", "letters"].includes(VARIANT) && given.observations) {
    given.observations = given.observations.map(digits);
  }
  return given;
}
