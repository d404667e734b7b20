//! Helpers of several test programs.

#![allow(dead_code, reason = "each test uses a part")]

use std::path::Path;

/// A trace of one agent at its start, in the older format, which lacks the last line with the hash.
pub const TRACE: &str = concat!(
    r#"{"format":"pogema-trace/1","spec":"pogema-1.4.0/1","config":{"num_agents":1,"radius":1,"max_steps":4,"#,
    r#""collision":"soft","on_goal":"finish","observation":"default"},"map":[".."],"starts":[[0,0]],"goals":[[[0,1]]]}"#,
    "\n",
    r#"{"cells":[[0,0]],"goals":[[0,1]],"active":[true],"on_goal":[false],"occupied":[[0,0]]}"#,
    "\n",
);

/// An error for the template: agent 1 enters occupied cells.
pub const CROWDED: [&str; 2] = ["and there not in taken", "and (there not in taken or agent == 1)"];

/// Writes a copy of the port `template.py` with planted errors: each pair holds a part of the template, which occurs
/// once, and its replacement.
pub fn write_wrong_port(path: &Path, wrong: &[[&str; 2]]) {
    let template = Path::new(env!("CARGO_MANIFEST_DIR")).join("../conformance/ports/template.py");
    let mut text = std::fs::read_to_string(template).unwrap();
    for [right, wrong] in wrong {
        assert_eq!(text.matches(right).count(), 1, "`{right}` in the template");
        text = text.replace(right, wrong);
    }
    std::fs::write(path, text).unwrap();
}
