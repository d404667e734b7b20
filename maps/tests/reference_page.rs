//! The page of configuration fields is generated from the code: names, accepted values and defaults from the reader,
//! meanings from the doc comments of `GridConfig`.
//!
//! With the environment variable `BLESS` set, this test writes the page instead of comparing.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]

use std::fmt::Write as _;
use std::path::Path;
use std::{env, fs};

use pogema_core::Error;
use pogema_maps::{FIELDS, GridConfig};
use serde_json::{Value, json};

const SOURCE: &str = include_str!("../src/config.rs");
const CONSTANTS: [&str; 3] = ["MOVES", "FREE", "OBSTACLE"];

fn read(name: &str, value: Value) -> Result<GridConfig, Error> {
    GridConfig::from_value(&json!({ name: value }))
}

/// Returns the accepted values, as the error for a value of the wrong type states them.
fn values(name: &str) -> String {
    match read(name, json!({"not": "a value"})) {
        Err(Error::Config { field, expected, .. }) if field == name => expected,
        other => panic!("{name}: {other:?}"),
    }
}

/// Returns the value that gives the same config as an absent field; null gives an empty string.
fn default(name: &str) -> String {
    let absent = GridConfig::from_value(&json!({})).unwrap();
    let words = ["default", "priority", "finish", "as_released", "own"].map(Value::from);
    let numbers = (0..=128).map(Value::from).chain((0..=10).map(|tenth| json!(f64::from(tenth) / 10.0)));
    let candidates = [Value::Null, json!(true), json!(false)].into_iter().chain(words).chain(numbers);
    let found =
        candidates.into_iter().find(|value| read(name, value.clone()).is_ok_and(|config| config == absent));
    match found.unwrap_or_else(|| panic!("{name}: the default is not among the candidates")) {
        Value::Null => String::new(),
        value => format!("`{}`", value.to_string().trim_matches('"')),
    }
}

/// Returns the doc comment of a field of `GridConfig`.
fn meaning(name: &str) -> String {
    let body = SOURCE.split_once("pub struct GridConfig {").unwrap().1;
    let (before, _) =
        body.split_once(&format!("    pub {name}: ")).unwrap_or_else(|| panic!("{name}: not found"));
    let docs = before.rsplit_once(",\n").map_or(before, |(_, docs)| docs);
    docs.lines().filter_map(|line| line.trim().strip_prefix("/// ")).collect::<Vec<_>>().join(" ")
}

fn page() -> String {
    let mut page = String::from(
        "# Configuration fields\n\n\
         This page is generated from the code: `BLESS=1 cargo test -p pogema-maps --test reference_page` writes it. \
         [Config](../spec/config.md) states how the fields depend on each other. Every field may be absent. A field \
         without a default may also be null: `None` in Python, `null` in YAML.\n\n\
         | field | default | values | meaning |\n| --- | --- | --- | --- |\n",
    );
    for name in FIELDS.into_iter().filter(|name| !CONSTANTS.contains(name)) {
        let (default, values, meaning) = (default(name), values(name), meaning(name));
        writeln!(page, "| `{name}` | {default} | {} | {meaning} |", values.replace('|', "\\|")).unwrap();
    }
    page += "\nThe ranges of `size`, `width`, `height` and `num_agents` are those of `limits: as_released`; `extended` raises \
             them.\n\n`MOVES`, `FREE` and `OBSTACLE` are accepted with POGEMA's own values only.\n\n\
             **What next:** [Run an episode](../guide/run.md), [Commands](cli.md).\n";
    page
}

#[test]
fn the_page_of_fields_is_up_to_date() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/reference/config.md");
    let page = page();
    if env::var_os("BLESS").is_some() {
        fs::write(&path, &page).unwrap();
    }
    assert!(
        fs::read_to_string(&path).unwrap() == page,
        "docs/reference/config.md is out of date: set BLESS=1"
    );
}
