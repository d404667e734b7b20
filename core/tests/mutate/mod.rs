//! Random small mutations of valid inputs.

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::{Index, select};
use serde_json::{Value, json};

/// Generates texts with up to four edits. Each edit replaces up to seven characters with a token, or repeats them after
/// the token.
pub fn mutated(
    texts: &'static [&'static str],
    tokens: &'static [&'static str],
) -> impl Strategy<Value = String> {
    let edit = (any::<Index>(), 0..8_usize, select(tokens), any::<bool>());
    (select(texts), vec(edit, 1..5)).prop_map(|(text, edits)| {
        let mut letters: Vec<char> = text.chars().collect();
        for (place, length, token, repeats) in edits {
            let begin = place.index(letters.len() + 1);
            let end = (begin + length).min(letters.len());
            let kept = if repeats { letters[begin..end].to_vec() } else { Vec::new() };
            letters.splice(begin..end, kept.iter().copied().chain(token.chars()).chain(kept.iter().copied()));
        }
        letters.into_iter().collect()
    })
}

/// Generates JSON values of any type, most of which are wrong in every place.
pub fn odd_value() -> impl Strategy<Value = Value> {
    let numbers = [json!(0), json!(1), json!(2), json!(-1), json!(0.5), json!(1e300), json!(-0.0)];
    let limits = [json!(i64::MIN), json!(i64::MAX), json!(u64::MAX), json!(65_535), json!(65_536)];
    let texts = ["", ".", "..\n.#", "aA", "@$", "\n\r\u{1b}\u{2028}", "NaN", "💥"].map(Value::from);
    let lists =
        [json!([]), json!([0]), json!([0, 0]), json!([1, 0]), json!([0, 0, 0]), json!([65_535, 65_535])];
    let cells =
        [json!([[0, 0]]), json!([[0, 0], [0, 1]]), json!([[[0, 0], [0, 1]]]), json!([[]]), json!([["."]])];
    let others =
        [Value::Null, json!(true), json!(false), json!({}), json!({ "a": 1 }), json!({ "": [null] })];
    let all = [&numbers[..], &limits, &texts, &lists, &cells, &others].concat();
    select(all)
}

/// Asserts that a message is one short line without control characters.
pub fn assert_one_line(message: &str) {
    assert!(!message.is_empty() && !message.chars().any(char::is_control), "{message:?}");
    assert!(message.chars().count() < 500, "{message}");
}
