//! Configs that cannot be read, each with its one-line error: syntax, types and ranges.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod rejected;

use pogema_core::Error;
use pogema_maps::{FIELDS, GridConfig, value_from_json};
use serde_json::{Value, json};

/// YAML texts that are not a valid object of fields.
const SYNTAX: [(&str, &str); 28] = [
    ("size: [", "config: line 1, column 7: unclosed bracket '['"),
    ("{size: 8", "config: line 1, column 1: unclosed bracket '{'"),
    ("'", "config: line 1, column 1: unclosed quote"),
    ("size: 8\nseed: a: b", "config: line 2, column 8: mapping values are not allowed in this context"),
    ("size: 1\n\tseed: 2", "config: line 1, column 7: while scanning a plain scalar, found a tab"),
    ("size: \u{7}", "config: line 1, column 7: unexpected character: `\\u{7}'"),
    ("map: @@", "config: line 1, column 6: unexpected character: `@'"),
    (
        "map: \"\\x\"",
        "config: line 1, column 6: while parsing a quoted scalar, did not find expected hexadecimal number",
    ),
    ("8", "config: found a number, expected fields and values such as `size: 8`"),
    ("eight", "config: found a string, expected fields and values such as `size: 8`"),
    ("yes", "config: found true or false, expected fields and values such as `size: 8`"),
    ("- size: 8\n- seed: 1", "config: found a list, expected fields and values such as `size: 8`"),
    ("[]", "config: found a list, expected fields and values such as `size: 8`"),
    ("size: 8\n---\nsize: 9", "config: line 3, column 1: found a second document, expected one"),
    ("%YAML 3.0\n---\nsize: 8", "config: line 1, column 1: unsupported YAML major version"),
    ("size: 8\nseed: 1\nsize: 9", "config: line 3, column 1: duplicate key `size`"),
    ("? [size]\n: 8", "config: line 1, column 3: expected string scalar"),
    ("null: 8", "config: line 1, column 1: null is not allowed here"),
    ("size: *side", "config: line 1, column 7: unknown alias"),
    ("map: &rows [*rows]", "config: line 1, column 13: an alias refers to a value that contains it"),
    ("<<: 8", "config: line 1, column 5: YAML merge value must be mapping or sequence of mappings"),
    // No tag is supported. Without an error, these two would be read as an absent map and a plain number.
    ("map: !..", "config: line 1, column 9: unsupported tag `!..`"),
    ("seed: !vault 8", "config: line 1, column 14: unsupported tag `!vault`"),
    ("colision_system: soft", "config: unknown field `colision_system`; did you mean `collision_system`?"),
    ("radius: 3", "config: unknown field `radius`; did you mean `obs_radius`?"),
    ("{size: 8, Seed: 3}", "config: unknown field `Seed`; did you mean `seed`?"),
    ("\"a\\nb\\e[2J\": 3", "config: unknown field `a\\nb\\u{1b}[2J`"),
    ("1: 2", "config: unknown field `1`"),
];

/// JSON texts that are not a valid object of fields.
const JSON: [(&str, &str); 7] = [
    ("", "config: line 1, column 0: EOF while parsing a value"),
    ("{\"size\": 8", "config: line 1, column 10: EOF while parsing an object"),
    ("{\n\"size\": 08}", "config: line 2, column 10: invalid number"),
    ("{\"density\": NaN}", "config: line 1, column 13: expected value"),
    ("{\"density\": 1e999}", "config: line 1, column 17: number out of range"),
    ("{\"size\": 8, \"size\": 9}", "config: line 1, column 18: duplicate key `size`"),
    ("null", "config: found nothing, expected fields and values such as `size: 8`"),
];

/// Numbers that JSON cannot express, or that do not fit the field's type.
const NUMBERS: [(&str, &str); 10] = [
    ("density: .nan", "config: line 1, column 10: `density` is `NaN`, expected a finite number"),
    ("size: 8\ndensity: .inf", "config: line 2, column 10: `density` is `inf`, expected a finite number"),
    ("density: -.inf", "config: line 1, column 10: `density` is `-inf`, expected a finite number"),
    ("density: 1e999", "config: line 1, column 10: `density` is `inf`, expected a finite number"),
    ("seed: .nan", "config: line 1, column 7: `seed` is `NaN`, expected a finite number"),
    ("agents_xy: [[0, .inf]]", "config: line 1, column 17: `agents_xy` is `inf`, expected a finite number"),
    (
        "seed: 18446744073709551615",
        "config: `seed` is `18446744073709551615`, expected a whole number from 0 to 9223372036854775806",
    ),
    (
        "seed: 100000000000000000000",
        "config: `seed` is `1e+20`, expected a whole number from 0 to 9223372036854775806",
    ),
    (
        "max_episode_steps: 9223372036854775808",
        "config: `max_episode_steps` is `9223372036854775808`, expected a 64-bit whole number",
    ),
    (
        "max_episode_steps: -9223372036854775809",
        "config: `max_episode_steps` is `-9.223372036854776e+18`, expected a 64-bit whole number",
    ),
];

/// Every field, its expected values, and the values of [`WRONG`] that it accepts; for some fields null means absent.
const TYPES: [(&str, &str, &str); 27] = [
    ("MOVES", "[[0,0],[-1,0],[1,0],[0,-1],[0,1]]", ""),
    ("FREE", "0", ""),
    ("OBSTACLE", "1", ""),
    ("empty_outside", "true or false", "true"),
    ("on_target", "one of `finish`, `nothing`, `restart`", ""),
    ("seed", "a whole number from 0 to 9223372036854775806", "null"),
    ("width", "a whole number from 1 to 4096", "null"),
    ("height", "a whole number from 1 to 4096", "null"),
    ("size", "a whole number from 2 to 4096", ""),
    ("density", "a number from 0 to 1", "0.5"),
    ("obs_radius", "a whole number from 1 to 128", ""),
    ("agents_xy", "a list of [row, col] pairs", "null []"),
    ("targets_xy", "a list of [row, col] goals, or of lists of at least two such goals", "null"),
    ("num_agents", "a whole number from 1 to 10000000", "null"),
    ("possible_agents_xy", "a list of [row, col] pairs", "null []"),
    ("possible_targets_xy", "a list of [row, col] pairs", "null []"),
    ("collision_system", "one of `priority`, `block_both`, `soft`", ""),
    ("persistent", "true or false", "true"),
    ("observation_type", "one of `default`, `POMAPF`, `MAPF`", ""),
    ("map", "a string or a list of rows", "null \"Soft\" []"),
    ("map_name", "a string", "null \"Soft\" \"2\""),
    ("integration", "one of `SampleFactory`, `PyMARL`, `rllib`, `gymnasium`, `PettingZoo`", "null"),
    ("max_episode_steps", "a 64-bit whole number", ""),
    ("auto_reset", "true or false", "null true"),
    ("occupancy", "one of `as_released`, `exact`", ""),
    ("reward", "one of `own`, `shared`", ""),
    ("limits", "one of `as_released`, `extended`", ""),
];

/// A value of each type. A field rejects all of them except those listed in [`TYPES`].
const WRONG: [&str; 7] = ["null", "true", "0.5", "\"Soft\"", "\"2\"", "[]", "{\"a\":1}"];

/// Whole-number fields with a range: the smallest and the largest value.
const RANGES: [(&str, i64, i64); 6] = [
    ("seed", 0, i64::MAX - 1),
    ("size", 2, 4096),
    ("width", 1, 4096),
    ("height", 1, 4096),
    ("num_agents", 1, 10_000_000),
    ("obs_radius", 1, 128),
];

fn yaml_error(text: &str) -> Option<Error> {
    GridConfig::from_yaml(text).err()
}

#[test]
fn unreadable_texts_are_rejected_with_their_messages() {
    rejected::check(&SYNTAX, &yaml_error);
    rejected::check(&NUMBERS, &yaml_error);
    rejected::check(&JSON, &|text| GridConfig::from_json(text).err());
}

#[test]
fn empty_texts_give_the_default_config() {
    for text in ["", " \n", "# nothing", "---", "~", "null", "{}", "---\n...\n"] {
        assert_eq!(GridConfig::from_yaml(text).unwrap(), GridConfig::default(), "{text:?}");
    }
}

#[test]
fn every_field_rejects_every_other_type() {
    assert_eq!(TYPES.map(|(field, ..)| field), FIELDS);
    for (field, expected, allowed) in TYPES {
        for wrong in WRONG.iter().filter(|wrong| !allowed.split(' ').any(|right| right == **wrong)) {
            let value = value_from_json(wrong).unwrap();
            let error = GridConfig::from_value(&json!({ field: value })).unwrap_err().to_string();
            let expected = match (field, *wrong) {
                ("map", "\"2\"") => {
                    "map: line 1, column 1: unknown character `2`, expected one of `.#@$!`, a-z or A-Z".into()
                }
                _ => format!("config: `{field}` is `{wrong}`, expected {expected}"),
            };
            assert_eq!(error, expected);
        }
    }
}

#[test]
fn ranges_are_inclusive() {
    let read = |field: &str, number: Value| {
        let other = if field == "width" { "height" } else { "width" };
        let is_side = field == "width" || field == "height";
        let config = if is_side { json!({ field: number, other: 2 }) } else { json!({ field: number }) };
        GridConfig::from_value(&config).map_err(|error| error.to_string())
    };
    for (field, least, most) in RANGES {
        let rejection = |number: i64| {
            Err(format!("config: `{field}` is `{number}`, expected a whole number from {least} to {most}"))
        };
        for inside in [least, most] {
            read(field, inside.into()).unwrap();
        }
        for outside in [least - 1, most + 1, -1, i64::MIN, i64::MAX] {
            assert_eq!(read(field, outside.into()), rejection(outside));
        }
    }
    for (number, is_inside) in
        [(0.0, true), (-0.0, true), (1.0, true), (-5e-324, false), (1.0 + f64::EPSILON, false)]
    {
        assert_eq!(read("density", number.into()).is_ok(), is_inside, "{number}");
    }
    let error = read("density", json!(-1)).unwrap_err();
    assert_eq!(error, "config: `density` is `-1`, expected a number from 0 to 1");
    for number in [i64::MIN, -1, 0, i64::MAX] {
        read("max_episode_steps", number.into()).unwrap();
    }
}

#[test]
fn extended_limits_are_inclusive() {
    for (field, most) in [("size", 65_279_u64), ("num_agents", 4_294_967_295)] {
        let read = |number: u64| GridConfig::from_value(&json!({ "limits": "extended", field: number }));
        read(most).unwrap();
        let error = read(most + 1).unwrap_err().to_string();
        assert!(error.ends_with(&format!("to {most}")), "{error}");
    }
}

#[test]
fn texts_that_expand_too_far_are_rejected() {
    let nine = |name: char, of: char| format!("{name}: &{name} [{}]\n", vec![format!("*{of}"); 9].join(", "));
    let bomb = format!(
        "a: &a [0, 0, 0, 0, 0, 0, 0, 0, 0]\n{}",
        ('b'..='i').map(|name| nine(name, (name as u8 - 1) as char)).collect::<String>()
    );
    let merges = (0..40).map(|at| format!("m{at}: &m{at} {{<<: [*m{}, *m{}], k{at}: 0}}\n", at - 1, at - 1));
    let merges = merges.collect::<String>().replace("*m-1, *m-1", "{size: 8}");
    for (text, reason) in [
        (bomb, "too large, or too many aliases"),
        (merges, "too large, or too many aliases"),
        (format!("map: {}", "[".repeat(100_000)), "recursion limit exceeded"),
        (format!("map: {}{}", "[".repeat(65), "]".repeat(65)), "too many levels of nesting"),
        (format!("{}0{}", "{a: ".repeat(200), "}".repeat(200)), "too many levels of nesting"),
    ] {
        let error = GridConfig::from_yaml(&text).unwrap_err().to_string();
        assert!(error.starts_with("config: line ") && error.ends_with(reason), "{error}");
    }
    let error = GridConfig::from_json(&"[".repeat(100_000)).unwrap_err().to_string();
    assert_eq!(error, "config: line 1, column 128: recursion limit exceeded");
}

#[test]
fn a_large_map_is_accepted() {
    let row = format!("[{}]", vec!["0"; 600].join(", "));
    let config = GridConfig::from_yaml(&format!("map: [{}]", vec![row; 600].join(", "))).unwrap();
    assert_eq!((config.width, config.height), (600, 600));
}
