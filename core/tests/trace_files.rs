//! Trace files: reading any file returns a trace or a one-line error, and a trace that is written and read back stays
//! the same.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod mutate;

use mutate::{assert_one_line, mutated, odd_value};
use pogema_core::{Map, Trace};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::Index;
use serde_json::Value;

const VALID: &str = r##"{"format":"pogema-trace/1","spec":"pogema-1.4.0/1","config":{"num_agents":2,"radius":1,"max_steps":4,"collision":"soft","on_goal":"finish","observation":"default"},"map":["..","#."],"outside":{"noise":["....","....","....","...."]},"starts":[[0,0],[1,1]],"goals":[[[0,1]],[[0,0],[1,1]]]}
{"cells":[[0,0],[1,1]],"goals":[[0,1],[0,0]],"active":[true,true],"on_goal":[false,false],"occupied":[[0,0],[1,1]]}
{"actions":[4,0],"cells":[[0,1],[1,1]],"goals":[[0,1],[0,0]],"active":[false,true],"on_goal":[true,false],"occupied":[[1,1]],"rewards":[1.0,0.0],"terminated":[true,false],"truncated":[false,false],"observations":{"type":"default","dtype":"float32","windows":["00","ff"]},"metrics":{"ISR":0.5}}
"##;

const TOKENS: [&str; 16] = [
    "", "[", "]", "{", "}", ",", ":", "\"", "\\u0000", "\n", "null", "-1", "65536", "1e999", "\u{7f}",
    "[[0,0]]",
];

/// A part of the valid trace, its replacement, and the message that the result is rejected with.
const REJECTED: [(&str, &str, &str); 20] = [
    (
        "pogema-trace/1",
        "pogema-trace/3",
        "trace: line 1: the format is `pogema-trace/3`, expected `pogema-trace/2` or `pogema-trace/1`",
    ),
    (
        "pogema-1.4.0/1",
        "pogema-2.0/1",
        "trace: line 1: the spec is `pogema-2.0/1`, expected `pogema-1.4.0/1`",
    ),
    // The version is checked first, because another version may have other fields.
    (
        "\"pogema-1.4.0/1\",\"config\":{",
        "\"pogema-2.0/1\",\"config\":{\"new\":1,",
        "trace: line 1: the spec is `pogema-2.0/1`, expected `pogema-1.4.0/1`",
    ),
    ("\"format\":\"pogema-trace/1\",", "", "trace: line 1: column 261: missing field `format`"),
    (
        "\"num_agents\":2",
        "\"num_agents\":0",
        "trace: line 1: config: `num_agents` is `0`, expected at least 1",
    ),
    ("\"num_agents\":2", "\"num_agents\":3", "trace: line 1: starts has length 2, expected 3"),
    ("\"radius\":1", "\"radius\":129", "trace: line 1: config: `radius` is `129`, expected 1 to 128"),
    (
        "\"..\",\"#.\"",
        "\"..\",\"#\"",
        "trace: line 1: column 180: map: line 2, column 2: the row has 1 cell, expected 2 as in the first row",
    ),
    (
        "[[0,0],[1,1]],\"goals\":[[[0,1]]",
        "[[0,0],[0,0]],\"goals\":[[[0,1]]",
        "trace: line 1: instance: agent 1: start (0, 0) is the start of agent 0 too",
    ),
    ("\"noise\":[\"....\",", "\"noise\":[", "trace: line 1: noise has length 3, expected 4"),
    (
        "[[0,0],[1,1]]]}",
        "[[0,0],[2,1]]]}",
        "trace: line 1: instance: agent 1: goal (2, 1) is outside the map of 2 rows and 2 columns",
    ),
    ("\"goals\":[[[0,1]]", "\"goals\":[[]", "trace: line 1: instance: agent 0: has no goal"),
    ("\"goals\":[[[0,1]],", "\"goals\":[", "trace: line 1: goals has length 1, expected 2"),
    (
        "\"on_goal\":[false,false]",
        "\"on_goal\":[false]",
        "trace: line 2: `on_goal` has length 1, expected 2, one for each agent",
    ),
    (
        "\"rewards\":[1.0,0.0]",
        "\"rewards\":[]",
        "trace: line 3: `rewards` has length 0, expected 2, one for each agent",
    ),
    (
        "\"actions\":[4,0]",
        "\"actions\":[5,0]",
        "trace: line 3: column 14: action is `5`, expected 0 (stay), 1 (up), 2 (down), 3 (left) or 4 (right)",
    ),
    (
        "\"radius\":1",
        "\"radius\":1.5",
        "trace: line 1: column 88: invalid type: floating point `1.5`, expected a whole number",
    ),
    ("[4,0]", "4", "trace: line 3: column 12: invalid type: integer `4`, expected a list"),
    (
        "\"collision\":\"soft\"",
        "\"collision\":\"hard\"",
        "trace: line 1: column 119: unknown variant `hard`, expected one of `priority`, `block_both`, `soft`",
    ),
    ("\"ISR\":0.5}}", "\"ISR\":0.5}", "trace: line 3: column 292: EOF while parsing an object"),
];

fn read(text: &str) -> Result<Trace, String> {
    Trace::read(text.as_bytes()).map_err(|error| error.to_string())
}

fn written(trace: &Trace) -> String {
    let mut text = Vec::new();
    trace.write(&mut text).unwrap();
    String::from_utf8(text).unwrap()
}

/// Checks that a text is either a trace that survives a round trip, or rejected with a one-line message.
fn check(text: &str) -> Result<(), TestCaseError> {
    match read(text) {
        Ok(trace) => prop_assert_eq!(&read(&written(&trace)).unwrap(), &trace),
        Err(message) => {
            assert_one_line(&message);
            prop_assert!(message.starts_with("trace: line "), "{message}");
            let rust_types = ["struct ", "enum ", "u16", "usize", "i32", "i64", "f32", "f64"];
            let rust_types = rust_types.map(|word| format!(", expected {word}"));
            prop_assert!(!rust_types.iter().any(|words| message.contains(words)), "{message}");
        }
    }
    Ok(())
}

#[test]
fn wrong_lines_are_rejected_with_their_number() {
    let steps = read(VALID).unwrap().steps;
    assert_eq!(steps.len(), 1);
    for (right, wrong, expected) in REJECTED {
        assert!(VALID.contains(right), "{right}");
        assert_eq!(read(&VALID.replacen(right, wrong, 1)).unwrap_err(), expected);
    }
    let lines: Vec<&str> = VALID.lines().collect();
    assert_eq!(read("").unwrap_err(), "trace: line 1: the trace ends before the header");
    assert_eq!(read(lines[0]).unwrap_err(), "trace: line 2: the trace ends before the start");
    let after_blanks = format!("{}\n{}\n\n \n{{}}", lines[0], lines[1]);
    assert_eq!(read(&after_blanks).unwrap_err(), "trace: line 5: column 2: missing field `actions`");
    assert!(Trace::read(&b"\xff"[..]).unwrap_err().to_string().starts_with("trace: line 1: "));
}

#[test]
fn cut_and_changed_files_are_rejected() {
    let whole = written(&read(VALID).unwrap());
    assert!(whole.starts_with("{\"format\":\"pogema-trace/2\","), "{whole}");
    let lines: Vec<&str> = whole.lines().collect();
    let last = lines[3];
    assert!(last.starts_with("{\"num_steps\":1,\"sha256\":\""), "{last}");
    assert_eq!(read(&whole), read(VALID));
    assert_eq!(read(&whole.replace('\n', "\r\n")), read(VALID));
    let ends = "the trace ends before its last line, `num_steps` and `sha256`";
    assert_eq!(read(&lines[..3].join("\n")).unwrap_err(), format!("trace: line 4: {ends}"));
    assert_eq!(read(&lines[..2].join("\n")).unwrap_err(), format!("trace: line 3: {ends}"));
    let without_step = [lines[0], lines[1], last].join("\n");
    let expected = "trace: line 3: `num_steps` is `1`, expected 0, the number of steps before it";
    assert_eq!(read(&without_step).unwrap_err(), expected);
    let changed = read(&whole.replacen("\"rewards\":[1.0", "\"rewards\":[0.5", 1)).unwrap_err();
    assert!(changed.starts_with("trace: line 4: `sha256` is `"), "{changed}");
    assert_one_line(&changed);
    let twice = read(&format!("{whole}{last}\n")).unwrap_err();
    assert_eq!(
        twice,
        "trace: line 5: an extra line after `num_steps` and `sha256`, expected the end of the file"
    );
    let damaged = read(&whole.replacen("{\"num_steps\":1", "{\"num_steps\":\"1\"", 1)).unwrap_err();
    assert!(
        damaged.starts_with("trace: line 4: column ") && damaged.contains("expected a whole number"),
        "{damaged}"
    );
    // Files of earlier versions lack the last line with the hash.
    let old = read(&format!("{VALID}{last}\n")).unwrap_err();
    assert!(old.starts_with("trace: line 4: column "), "{old}");
}

#[test]
fn a_long_word_is_not_quoted_in_full() {
    let long = format!("\"format\":\"{}\"", "pogema".repeat(1000));
    assert_one_line(&read(&VALID.replacen("\"format\":\"pogema-trace/1\"", &long, 1)).unwrap_err());
    let long = format!("\"{}\":1,\"radius\"", "radius".repeat(1000));
    assert_one_line(&read(&VALID.replacen("\"radius\"", &long, 1)).unwrap_err());
}

/// Returns the JSON pointers of all parts of a value, itself included.
fn places(value: &Value, at: &str) -> Vec<String> {
    let mut all = vec![at.to_owned()];
    match value {
        Value::Array(list) => {
            all.extend((0..).zip(list).flat_map(|(key, part)| places(part, &format!("{at}/{key}"))));
        }
        Value::Object(object) => {
            all.extend(object.iter().flat_map(|(key, part)| places(part, &format!("{at}/{key}"))));
        }
        _ => {}
    }
    all
}

/// Generates traces that are valid except for up to three odd values.
fn almost_valid() -> impl Strategy<Value = String> {
    let edits = vec((any::<Index>(), any::<Index>(), odd_value()), 1..4);
    edits.prop_map(|edits| {
        let mut lines: Vec<Value> = VALID.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        for (line, place, value) in edits {
            let line = line.get_mut(&mut lines);
            let places = places(line, "");
            *line.pointer_mut(&places[place.index(places.len())]).unwrap() = value;
        }
        lines.iter().map(Value::to_string).collect::<Vec<_>>().join("\n")
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(2000) })]

    #[test]
    fn any_text_survives_a_round_trip_or_is_rejected_in_one_line(text in any::<String>()) {
        check(&text)?;
    }

    #[test]
    fn any_bytes_are_read_or_rejected_in_one_line(bytes in vec(any::<u8>(), 0..200)) {
        if let Err(error) = Trace::read(&bytes[..]) {
            assert_one_line(&error.to_string());
        }
    }

    #[test]
    fn a_mutated_trace_survives_a_round_trip_or_is_rejected_in_one_line(text in mutated(&[VALID], &TOKENS)) {
        check(&text)?;
    }

    #[test]
    fn an_almost_valid_trace_survives_a_round_trip_or_is_rejected_in_one_line(text in almost_valid()) {
        check(&text)?;
    }
}

#[test]
fn rows_without_cells_below_a_long_first_row_are_rejected() {
    let rows: Vec<String> = std::iter::once(".".repeat(60_000)).chain(vec![String::new(); 60_000]).collect();
    let error = Map::from_rows(&rows).unwrap_err().to_string();
    assert_eq!(error, "map: line 2, column 1: the row has 0 cells, expected 60000 as in the first row");
    let rows: Vec<String> =
        std::iter::once(".".repeat(400_000)).chain(vec![String::new(); 400_000]).collect();
    let error = Map::from_rows(&rows).unwrap_err().to_string();
    assert!(error.contains("400001 x 400000 cells, expected at most"), "{error}");
}
