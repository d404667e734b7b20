//! No config or map text causes a panic. Each text is read, or rejected with a one-line error; a config that was read
//! survives a round trip, and its instances are generated or rejected with a one-line error.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

#[path = "../../core/tests/mutate/mod.rs"]
mod mutate;

use mutate::{assert_one_line, mutated, odd_value};
use pogema_core::Map;
use pogema_maps::{FIELDS, GridConfig, InstanceSource, parse_map_text};
use proptest::collection::{btree_map, vec};
use proptest::prelude::*;
use proptest::sample::select;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use serde_json::{Map as Object, Value, json};

const CONFIGS: [&str; 5] = [
    "size: 8\nnum_agents: 3\nseed: 42\ndensity: 0.3\nobs_radius: 2\ncollision_system: soft\n",
    "map: |\n  ..#a\n  A.#.\non_target: nothing # no more\nempty_outside: false\n",
    "{agents_xy: [[0, 0], [1, 1]], targets_xy: [[[0, 1], [1, 0]], [[2, 2], [0, 0]]], on_target: restart}",
    "base: &base [[0, 1]]\nmap: '@$.!'\npossible_agents_xy: *base\n",
    "{\"map\": [[0, 1], [0, 0]], \"possible_agents_xy\": [[0, 0]], \"possible_targets_xy\": [[1, 1]], \"seed\": 1}",
];

const TOKENS: [&str; 40] = [
    "",
    " ",
    "\n",
    "\n  ",
    "\t",
    "\r",
    ":",
    ": ",
    "-",
    "- ",
    "[",
    "]",
    "{",
    "}",
    ",",
    "#",
    " #",
    "'",
    "\"",
    "|",
    ">",
    "&a",
    "*a",
    "<<: ",
    "!",
    "!!",
    "%",
    "@",
    "?",
    "---\n",
    "\\",
    "\0",
    "💥",
    "\u{feff}",
    "null",
    "-1",
    ".nan",
    "1e999",
    "9999999999",
    "size: 3",
];

const MAPS: [&str; 3] = ["..#\n.#.\n...\n", "  @@$ \n  !.# \n", "aB.\nAb#"];

const MAP_TOKENS: [&str; 12] = ["", ".", "#", "@", "!", "a", "Z", " ", "\n", "\u{1c}", "é", "..."];

/// Maximum number of cells of a map for which instances are generated.
const MAX_CELLS: usize = 2_500;

fn check_config(read: Result<GridConfig, pogema_core::Error>) -> Result<(), TestCaseError> {
    match read {
        Ok(config) => {
            prop_assert_eq!(&GridConfig::from_value(&config.to_value()).unwrap(), &config);
            check_instances(config);
        }
        Err(error) => assert_one_line(&error.to_string()),
    }
    Ok(())
}

/// Resets twice, because a reset changes the pools. Draws some goals after each reset.
fn check_instances(config: GridConfig) {
    if config.width * config.height > MAX_CELLS {
        return;
    }
    let registered = config.map_name.is_some().then(|| Map::from_rows(&["...", ".#."]).unwrap());
    let mut source = InstanceSource::new(config, registered).unwrap();
    for _reset in 0..2 {
        match source.generate() {
            Ok(generated) => {
                assert_eq!(generated.instance.starts().len(), source.config().num_agents);
                generated.instance.goals().iter().for_each(|goals| assert_eq!(goals.list(8).len(), 8));
                generated.warnings.iter().for_each(|warning| assert_one_line(warning));
            }
            Err(error) => assert_one_line(&error.to_string()),
        }
    }
}

/// Draws a value that a field accepts or almost accepts.
fn likely_value(field: &'static str) -> BoxedStrategy<Value> {
    let cell = (0..4_u8, 0..4_u8).prop_map(|(row, col)| json!([row, col]));
    let cells = vec(cell, 0..5);
    match field {
        "MOVES" => Just(json!([[0, 0], [-1, 0], [1, 0], [0, -1], [0, 1]])).boxed(),
        "FREE" => Just(json!(0)).boxed(),
        "OBSTACLE" => Just(json!(1)).boxed(),
        "on_target" => select(&["finish", "nothing", "restart"][..]).prop_map(Value::from).boxed(),
        "collision_system" => select(&["priority", "block_both", "soft"][..]).prop_map(Value::from).boxed(),
        "observation_type" => select(&["default", "POMAPF", "MAPF"][..]).prop_map(Value::from).boxed(),
        "integration" => select(&["SampleFactory", "PyMARL", "gymnasium"][..]).prop_map(Value::from).boxed(),
        "occupancy" => select(&["as_released", "exact"][..]).prop_map(Value::from).boxed(),
        "reward" => select(&["own", "shared"][..]).prop_map(Value::from).boxed(),
        "limits" => select(&["as_released", "extended"][..]).prop_map(Value::from).boxed(),
        "empty_outside" | "persistent" | "auto_reset" => any::<bool>().prop_map(Value::from).boxed(),
        "density" => (0.0..=1.0).prop_map(Value::from).boxed(),
        "seed" | "max_episode_steps" => any::<u32>().prop_map(Value::from).boxed(),
        "map" => "[.#aAbB@$!]{1,5}( [.#aAbB@$!]{1,5}){0,4}|[.#]{4} [.#]{4} [.#]{4} [.#]{4}"
            .prop_map(Value::from)
            .boxed(),
        "map_name" => Just(json!("three by two")).boxed(),
        "agents_xy" | "possible_agents_xy" | "possible_targets_xy" => cells.prop_map(Value::from).boxed(),
        "targets_xy" => {
            prop_oneof![cells.clone(), vec(cells.prop_map(Value::from), 0..4)].prop_map(Value::from).boxed()
        }
        _ => (1..6_u8).prop_map(Value::from).boxed(),
    }
}

/// Draws a config with some fields, one in eight of them with an odd value.
fn almost_valid() -> impl Strategy<Value = Value> {
    let field = select(&FIELDS[..]).prop_flat_map(|field| {
        let value = prop_oneof![7 => likely_value(field), 1 => odd_value()];
        (Just(field.to_owned()), value)
    });
    vec(field, 0..8).prop_map(|fields| Value::Object(fields.into_iter().collect::<Object<_, _>>()))
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(3000) })]

    #[test]
    fn any_text_is_read_or_rejected_as_config(text in any::<String>()) {
        check_config(GridConfig::from_yaml(&text))?;
        check_config(GridConfig::from_json(&text))?;
    }

    #[test]
    fn mutated_configs_are_read_or_rejected(text in mutated(&CONFIGS, &TOKENS)) {
        check_config(GridConfig::from_yaml(&text))?;
        check_config(GridConfig::from_json(&text))?;
    }

    #[test]
    fn almost_valid_configs_are_read_or_rejected(value in almost_valid()) {
        check_config(GridConfig::from_value(&value))?;
    }

    #[test]
    fn json_is_yaml(value in almost_valid()) {
        let text = value.to_string();
        prop_assert_eq!(GridConfig::from_json(&text), GridConfig::from_yaml(&text));
        prop_assert_eq!(GridConfig::from_json(&text), GridConfig::from_value(&value));
    }

    #[test]
    fn odd_values_never_panic(fields in btree_map(select(&FIELDS[..]).prop_map(str::to_owned), odd_value(), 0..4)) {
        check_config(GridConfig::from_value(&json!(fields)))?;
    }

    #[test]
    fn any_text_is_read_or_rejected_as_map(text in prop_oneof![any::<String>(), mutated(&MAPS, &MAP_TOKENS)]) {
        match parse_map_text(&text) {
            Ok(parsed) => {
                let plain = parsed.map.rows().join("\n");
                prop_assert_eq!(parse_map_text(&plain).unwrap().map, parsed.map);
            }
            Err(error) => assert_one_line(&error.to_string()),
        }
    }
}

#[test]
fn maps_of_many_short_rows_are_rejected_quickly() {
    let text = ". ".repeat(200_000);
    let error = parse_map_text(&text).unwrap_err().to_string();
    assert_eq!(error, "map: line 1, column 130559: the map has more than 65279 rows or columns");
}

#[test]
fn almost_valid_configs_are_often_valid() {
    let mut runner = TestRunner::deterministic();
    let (mut num_read, mut num_made) = (0, 0);
    for _case in 0..1000 {
        let value = almost_valid().new_tree(&mut runner).unwrap().current();
        if let Ok(config) = GridConfig::from_value(&value) {
            num_read += 1;
            let is_small = config.width * config.height <= MAX_CELLS;
            let made = |config| InstanceSource::new(config, None)?.generate();
            num_made += usize::from(is_small && made(config).is_ok());
        }
    }
    assert!(num_read > 200 && num_made > 100 && num_made < num_read, "{num_read} read, {num_made} made");
}

#[test]
fn maps_longer_than_the_fields_allow_survive_a_round_trip() {
    let config = GridConfig::from_value(&json!({ "map": ".".repeat(5_000) })).unwrap();
    assert_eq!(GridConfig::from_value(&config.to_value()).unwrap(), config);
}
