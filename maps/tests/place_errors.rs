//! Configs with invalid maps, invalid positions or inconsistent fields, each with its one-line error, and configs that
//! fail only when an instance is generated.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod rejected;

use pogema_core::Error;
use pogema_maps::{GridConfig, InstanceSource};

/// Fields that require or exclude each other.
const TOGETHER: [(&str, &str); 7] = [
    ("width: 5", "config: `width` is `5`, expected the field `height`, too"),
    ("{height: 5, size: 5}", "config: `height` is `5`, expected the field `width`, too"),
    ("{width: 5, height: null}", "config: `width` is `5`, expected the field `height`, too"),
    (
        "auto_reset: true",
        "config: `auto_reset` is `true`, expected false, because only the integration `SampleFactory` resets automatically",
    ),
    (
        "{auto_reset: true, integration: gymnasium}",
        "config: `auto_reset` is `true`, expected false, because only the integration `SampleFactory` resets automatically",
    ),
    (
        "{map: aA, agents_xy: [[0, 0]], targets_xy: [[0, 1]]}",
        "config: `map` is `a map with letters`, expected starts and goals either in the map or in agents_xy and targets_xy",
    ),
    (
        "{map: aA, on_target: restart}",
        "config: `targets_xy` is `one goal per agent`, expected goal sequences such as [[[0, 0], [1, 1]]] with \
         on_target `restart`",
    ),
];

/// Maps, as text and as lists.
const MAPS: [(&str, &str); 23] = [
    ("map: ''", "map: line 1, column 1: the map has no cell, expected some of `.#@$!`, a-z and A-Z"),
    ("map: \" \\n \"", "map: line 1, column 1: the map has no cell, expected some of `.#@$!`, a-z and A-Z"),
    ("map: |\n  ..\n  ...\n", "map: line 2, column 3: the row has 3 cells, expected 2 as in the first row"),
    ("map: |\n  ...\n\n  ..\n", "map: line 3, column 3: the row has 2 cells, expected 3 as in the first row"),
    ("map: |\n  .. #\n  ..\n", "map: line 1, column 5: the row has 1 cell, expected 2 as in the first row"),
    ("map: >\n  ..\n  .\n", "map: line 1, column 5: the row has 1 cell, expected 2 as in the first row"),
    (
        "map: |\n  ..\n   .X\n  .1\n",
        "map: line 3, column 2: unknown character `1`, expected one of `.#@$!`, a-z or A-Z",
    ),
    ("map: \".é\"", "map: line 1, column 2: unknown character `é`, expected one of `.#@$!`, a-z or A-Z"),
    ("map: \".\\0\"", "map: line 1, column 2: unknown character `\\0`, expected one of `.#@$!`, a-z or A-Z"),
    (
        "map: \"..\\e[2J\"",
        "map: line 1, column 3: unknown character `\\u{1b}`, expected one of `.#@$!`, a-z or A-Z",
    ),
    ("map: a", "instance: the map has 1 start (a-z) and 0 goals (A-Z), expected equal numbers"),
    ("map: aAbb", "instance: the map has 2 starts (a-z) and 1 goal (A-Z), expected equal numbers"),
    (
        "map: aA@",
        "instance: the map has letters and one of `@$!`, expected either exact or possible starts and goals",
    ),
    (
        "map: a!A",
        "instance: the map has letters and one of `@$!`, expected either exact or possible starts and goals",
    ),
    ("map: []", "config: `map` is `[]`, expected at least one row of at least one cell"),
    ("map: [[], []]", "config: `map` is `[[],[]]`, expected at least one row of at least one cell"),
    ("map: [[0, 0], [0]]", "map: line 2, column 2: the row has 1 cell, expected 2 as in the first row"),
    ("map: [[0], []]", "map: line 2, column 1: the row has 0 cells, expected 1 as in the first row"),
    ("map: [[0, 2]]", "map: line 1, column 2: `2` is not 0 (free) or 1 (obstacle)"),
    ("map: [[0], [0.0]]", "map: line 2, column 1: `0.0` is not 0 (free) or 1 (obstacle)"),
    ("map: [[true]]", "map: line 1, column 1: `true` is not 0 (free) or 1 (obstacle)"),
    ("map: [0, 1]", "config: `map` is `0`, expected a row as a list of 0 and 1"),
    ("map: ['..', '..']", "config: `map` is `\"..\"`, expected a row as a list of 0 and 1"),
];

/// Values that are not a valid pair `[row, col]`.
const PAIRS: [&str; 11] = [
    "0",
    "null",
    "\"00\"",
    "[]",
    "[0]",
    "[0,0,0]",
    "[-1,0]",
    "[0,65536]",
    "[0,1.0]",
    "[0,\"0\"]",
    "{\"row\":0}",
];

/// Starts and goals.
const POSITIONS: [(&str, &str); 17] = [
    (
        "agents_xy: [[8, 0]]",
        "config: `agents_xy` is `(8, 0)`, expected cells inside the map of 8 rows and 8 columns",
    ),
    (
        "agents_xy: [[0, 8]]",
        "config: `agents_xy` is `(0, 8)`, expected cells inside the map of 8 rows and 8 columns",
    ),
    (
        "{agents_xy: [[2, 0], [0, 3]], width: 3, height: 4}",
        "config: `agents_xy` is `(0, 3)`, expected cells inside the map of 4 rows and 3 columns",
    ),
    (
        "{map: '..', agents_xy: [[1, 0]]}",
        "config: `agents_xy` is `(1, 0)`, expected cells inside the map of 1 row and 2 columns",
    ),
    (
        "targets_xy: [[9, 9]]",
        "config: `targets_xy` is `(9, 9)`, expected cells inside the map of 8 rows and 8 columns",
    ),
    (
        "targets_xy: [[[0, 0], [0, 8]]]",
        "config: `targets_xy` is `(0, 8)`, expected cells inside the map of 8 rows and 8 columns",
    ),
    (
        "targets_xy: []",
        "config: `targets_xy` is `[]`, expected a list of [row, col] goals, or of lists of at least two such goals",
    ),
    (
        "targets_xy: [[[0, 0]]]",
        "config: `targets_xy` is `[[0,0]]`, expected at least two goals in the sequence of an agent",
    ),
    (
        "targets_xy: [[[0, 0], [0, 1]], []]",
        "config: `targets_xy` is `[]`, expected at least two goals in the sequence of an agent",
    ),
    (
        "targets_xy: [[0, 0], [[0, 1], [1, 0]]]",
        "config: `targets_xy` is `[[0,1],[1,0]]`, expected a pair [row, col] of whole numbers from 0 to 65535",
    ),
    (
        "targets_xy: [[[0, 0], [0, 1]], [1, 0]]",
        "config: `targets_xy` is `1`, expected a pair [row, col] of whole numbers from 0 to 65535",
    ),
    (
        "targets_xy: [[[[0, 0], [0, 1]], [[0, 0], [0, 1]]]]",
        "config: `targets_xy` is `[[0,0],[0,1]]`, expected a pair [row, col] of whole numbers from 0 to 65535",
    ),
    (
        "targets_xy: [[[0, 0], [0, -1]]]",
        "config: `targets_xy` is `[0,-1]`, expected a pair [row, col] of whole numbers from 0 to 65535",
    ),
    (
        "{targets_xy: [[0, 0]], on_target: restart}",
        "config: `targets_xy` is `one goal per agent`, expected goal sequences such as [[[0, 0], [1, 1]]] with \
         on_target `restart`",
    ),
    ("agents_xy: 0", "config: `agents_xy` is `0`, expected a list of [row, col] pairs"),
    (
        "possible_agents_xy: {a: 1}",
        "config: `possible_agents_xy` is `{\"a\":1}`, expected a list of [row, col] pairs",
    ),
    (
        "possible_targets_xy: ['a long text that stands for something even longer than the line']",
        "config: `possible_targets_xy` is `\"a long text that stands for something even longer than the …`, expected \
         a pair [row, col] of whole numbers from 0 to 65535",
    ),
];

/// Configs that are read, but rejected when an instance is generated.
const INSTANCES: [(&str, &str); 17] = [
    (
        "{agents_xy: [[0, 0]], targets_xy: [[0, 1], [1, 1]]}",
        "config: `targets_xy` is `a list of 2`, expected a list of 1, one for each agent in agents_xy",
    ),
    (
        "{agents_xy: [[0, 0], [0, 1]], targets_xy: [[1, 1]]}",
        "config: `targets_xy` is `a list of 1`, expected a list of 2, one for each agent in agents_xy",
    ),
    (
        "{agents_xy: [[0, 0], [1, 0]], targets_xy: [[[0, 1], [1, 1]]], on_target: restart}",
        "config: `targets_xy` is `a list of 1`, expected a list of 2, one for each agent in agents_xy",
    ),
    (
        "{agents_xy: [[0, 0]], targets_xy: [[0, 1]], num_agents: 2}",
        "config: `num_agents` is `2`, expected at most 1, the number of agents in agents_xy",
    ),
    (
        "{agents_xy: [[0, 0], [0, 0]], targets_xy: [[0, 1], [1, 1]]}",
        "instance: agent 1: start (0, 0) is the start of agent 0 too",
    ),
    (
        "{size: 2, num_agents: 3, density: 0, seed: 1}",
        "config: `num_agents` is `3`, expected at most 2; the map has no room for more",
    ),
    (
        "{size: 2, num_agents: 3, density: 0}",
        "config: `num_agents` is `3`, expected at most 2; the map has no room for more",
    ),
    ("density: 1", "config: `num_agents` is `1`, expected at most 0; the map has no room for more"),
    ("map: '#'", "config: `num_agents` is `1`, expected at most 0; the map has no room for more"),
    (
        "{map: '.#.', num_agents: 10000000}",
        "config: `num_agents` is `10000000`, expected at most 0; the map has no room for more",
    ),
    (
        "{map: '@@$', num_agents: 2}",
        "config: `num_agents` is `2`, expected at most 1, the number of cells in possible_targets_xy",
    ),
    (
        "{possible_agents_xy: [[0, 0]], possible_targets_xy: [[0, 1], [0, 0]], num_agents: 2}",
        "config: `num_agents` is `2`, expected at most 1, the number of cells in possible_agents_xy",
    ),
    (
        "{possible_agents_xy: [[0, 0], [0, 0]], possible_targets_xy: [[0, 1], [1, 1]], num_agents: 2}",
        "instance: agent 1: start (0, 0) is the start of agent 0 too",
    ),
    (
        "{possible_agents_xy: [[9, 0]], possible_targets_xy: [[0, 1]]}",
        "config: `possible_agents_xy` is `(9, 0)`, expected cells inside the map of 8 rows and 8 columns",
    ),
    ("map_name: nowhere", "config: `map_name` is `nowhere`, expected the name of a registered map"),
    (
        "{targets_xy: [[[0, 1], [1, 1]]], on_target: restart, num_agents: 2, seed: 0}",
        "config: `targets_xy` is `1 sequence`, expected 2 sequences, one for each agent",
    ),
    (
        "{map: '..', possible_targets_xy: [], on_target: restart}",
        "instance: agent 0: no next goal can be drawn from possible_targets_xy",
    ),
];

fn yaml_error(text: &str) -> Option<Error> {
    GridConfig::from_yaml(text).err()
}

#[test]
fn inconsistent_fields_are_rejected() {
    rejected::check(&TOGETHER, &yaml_error);
}

#[test]
fn invalid_maps_are_rejected() {
    rejected::check(&MAPS, &yaml_error);
}

#[test]
fn the_error_for_invalid_positions_names_the_first() {
    rejected::check(&POSITIONS, &yaml_error);
    for field in ["agents_xy", "targets_xy", "possible_agents_xy", "possible_targets_xy"] {
        for pair in PAIRS {
            let expected = format!(
                "config: `{field}` is `{pair}`, expected a pair [row, col] of whole numbers from 0 to 65535"
            );
            rejected::check(&[(&format!("{field}: [[0, 0], {pair}]"), &expected)], &yaml_error);
        }
    }
}

#[test]
fn impossible_instances_are_rejected() {
    rejected::check(&INSTANCES, &|text| {
        let config = GridConfig::from_yaml(text).unwrap();
        InstanceSource::new(config, None).and_then(|mut source| source.generate()).err()
    });
}

#[test]
fn a_failed_reset_leaves_the_pools_unchanged() {
    let mut num_rejected = 0;
    for seed in 0..20 {
        let pools = "possible_agents_xy: [[0, 0], [0, 0], [0, 1]], possible_targets_xy: [[1, 0], [1, 1]]";
        let config = GridConfig::from_yaml(&format!("{{{pools}, num_agents: 2, seed: {seed}}}")).unwrap();
        let mut source = InstanceSource::new(config, None).unwrap();
        // If a failed reset left the pools shuffled, most second resets would draw two different starts and succeed.
        if let Err(first) = source.generate() {
            num_rejected += 1;
            assert_eq!(source.generate().unwrap_err(), first, "seed {seed}");
        }
    }
    assert!((4..17).contains(&num_rejected), "{num_rejected}");
}
