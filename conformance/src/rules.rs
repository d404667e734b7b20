//! The rules of the spec, each in one or two sentences.

/// A line per rule: its name, a tab, and the first sentences of its section. `BLESS=1 ./check rules` writes the
/// table.
const TABLE: &str = include_str!("rules.txt");

/// Returns the name and the statement of every rule, sorted by name.
pub fn all() -> impl Iterator<Item = (&'static str, &'static str)> {
    TABLE.lines().filter_map(|line| line.split_once('\t'))
}

/// Returns what a rule says.
pub fn statement_of(rule: &str) -> Option<&'static str> {
    all().find(|(name, _)| *name == rule).map(|(_, statement)| statement)
}
