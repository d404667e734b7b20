//! All reasons for which we reject configs that POGEMA accepts. Each matches only the rejections that it names.

use serde_json::Value;

const INTEGERS: [&str; 7] =
    ["seed", "width", "height", "size", "obs_radius", "num_agents", "max_episode_steps"];
const FLAGS: [&str; 3] = ["empty_outside", "persistent", "auto_reset"];
const OURS: [&str; 3] = ["occupancy", "reward", "limits"];
const POOLS: [&str; 2] = ["possible_agents_xy", "possible_targets_xy"];
const POSITIONS: [&str; 4] = ["agents_xy", "targets_xy", "possible_agents_xy", "possible_targets_xy"];

/// A rejected config and our error message.
struct Rejection<'a> {
    config: &'a Value,
    message: &'a str,
}

impl Rejection<'_> {
    fn says(&self, text: &str) -> bool {
        self.message.contains(text)
    }

    /// Returns whether the message is about one of these fields and the value of that field satisfies `has`.
    fn is_about(&self, fields: &[&str], has: impl Fn(&Value) -> bool) -> bool {
        let field = self.message.strip_prefix("config: `").and_then(|rest| rest.split('`').next());
        field.is_some_and(|field| fields.contains(&field) && self.config.get(field).is_some_and(has))
    }
}

type Holds = fn(&Rejection<'_>) -> bool;

const REASONS: [(&str, Holds); 21] = [
    ("an unknown key", |no| no.says("config: unknown field `")),
    ("a float given for an integer", |no| no.is_about(&INTEGERS, Value::is_f64)),
    ("a number given as text", |no| no.is_about(&numbers(), Value::is_string)),
    ("a boolean given for a number", |no| no.is_about(&numbers(), Value::is_boolean)),
    ("a constant of another type", |no| {
        no.is_about(&["FREE", "OBSTACLE"], |value| value.is_boolean() || value.is_f64())
    }),
    ("a flag given as a number or word", |no| {
        no.is_about(&FLAGS, |value| value.is_number() || value.is_string())
    }),
    ("a name that is a number or boolean", |no| {
        no.is_about(&["map_name"], |value| value.is_number() || value.is_boolean()) && no.says("a string")
    }),
    ("a boolean given for a coordinate", |no| {
        no.is_about(&POSITIONS, holds_boolean) && no.says("expected a pair")
    }),
    ("a pool that is not a list of cells", |no| {
        no.is_about(&POOLS, |_| true) && (no.says("expected a pair") || no.says("expected a list of"))
    }),
    ("an episode length above 2^63 - 1", |no| {
        no.is_about(&["max_episode_steps"], |value| value.is_u64() && !value.is_i64())
    }),
    ("a changed table of moves", |no| no.is_about(&["MOVES"], Value::is_array)),
    ("letters with lifelong goals", |no| {
        no.says("config: `targets_xy` is `one goal per agent`") && no.config["map"].is_string()
    }),
    ("cells other than 0 and 1", |no| {
        no.says("is not 0 (free) or 1 (obstacle)") && no.config["map"].is_array()
    }),
    ("an unknown map", |no| no.is_about(&["map_name"], Value::is_string) && no.says("a registered map")),
    ("two agents with the same start", |no| no.says("is the start of agent")),
    ("a pool with cells outside the map", |no| {
        no.is_about(&POOLS, Value::is_array) && no.says("expected cells inside")
    }),
    ("a pool without a next goal", |no| no.says("no next goal can be drawn from possible_targets_xy")),
    ("sequences for some agents only", |no| {
        no.is_about(&["targets_xy"], Value::is_array) && no.says("one for each agent")
    }),
    ("throughput over zero steps", |no| no.is_about(&["max_episode_steps"], |value| *value == 0)),
    ("an invalid value of one of our own fields", |no| no.is_about(&OURS, |_| true)),
    ("a named map that is too small", |no| {
        no.says("the map has no room for more") && no.config["map_name"].is_string()
    }),
];

fn numbers() -> Vec<&'static str> {
    INTEGERS.into_iter().chain(["density"]).collect()
}

fn holds_boolean(value: &Value) -> bool {
    match value {
        Value::Bool(_) => true,
        Value::Array(list) => list.iter().any(holds_boolean),
        _ => false,
    }
}

/// Returns the name of the reason for a rejection, if it is a known one.
pub fn reason(config: &Value, message: &str) -> Option<&'static str> {
    let rejection = Rejection { config, message };
    REASONS.iter().find(|(_, holds)| holds(&rejection)).map(|(name, _)| *name)
}

/// Returns the names of all reasons.
pub fn names() -> impl Iterator<Item = &'static str> {
    REASONS.iter().map(|(name, _)| *name)
}
