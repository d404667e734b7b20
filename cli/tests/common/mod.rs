//! Helpers of several test programs.

use std::path::Path;

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
