// A port that reports metrics in every step, not only at the end of an episode.

import { answer as templateAnswer } from "../../ports/template.mjs";

export function answer(question) {
  const given = templateAnswer(question);
  if (question.type === "hello") {
    return { ...given, profiles: [...given.profiles, "metrics"], metrics: ["ISR"] };
  }
  return "rewards" in given ? { ...given, metrics: { ISR: 0.5 } } : given;
}
