//! As much of JSON Schema as the protocol's schema uses. The crate `jsonschema` knows all of it, but brings 30 other
//! crates and adds more than a minute of processor time to the build of the checks.

use serde_json::Value;

/// What in a value does not fit a schema; unknown keywords are no good either.
pub fn mismatch(root: &Value, schema: &Value, value: &Value) -> Option<String> {
    let keywords = schema.as_object().unwrap();
    let wrong = keywords.iter().find(|(keyword, wanted)| !fits(root, keyword, wanted, schema, value));
    wrong.map(|(keyword, wanted)| format!("{value} does not fit `{keyword}`: {wanted}"))
}

fn fits(root: &Value, keyword: &str, wanted: &Value, schema: &Value, value: &Value) -> bool {
    let is_valid = |schema: &Value, value: &Value| mismatch(root, schema, value).is_none();
    let count =
        |schemas: &Value| schemas.as_array().unwrap().iter().filter(|one| is_valid(one, value)).count();
    let number = |wanted: &Value| wanted.as_f64().unwrap();
    match keyword {
        "$schema" | "$id" | "title" | "description" | "$defs" => true,
        "$ref" => is_valid(root.pointer(wanted.as_str().unwrap().strip_prefix('#').unwrap()).unwrap(), value),
        "anyOf" => count(wanted) > 0,
        "oneOf" => count(wanted) == 1,
        "not" => !is_valid(wanted, value),
        "const" => value == wanted,
        "enum" => wanted.as_array().unwrap().contains(value),
        "type" => wanted
            .as_array()
            .map_or_else(|| is_of(wanted, value), |all| all.iter().any(|one| is_of(one, value))),
        "required" => value.as_object().is_none_or(|object| {
            wanted.as_array().unwrap().iter().all(|key| object.contains_key(key.as_str().unwrap()))
        }),
        "properties" => wanted
            .as_object()
            .unwrap()
            .iter()
            .all(|(key, schema)| value.get(key).is_none_or(|value| is_valid(schema, value))),
        "additionalProperties" => value.as_object().is_none_or(|object| {
            let is_known = |key: &str| schema["properties"].get(key).is_some();
            object.iter().filter(|(key, _)| !is_known(key)).all(|(_, value)| is_valid(wanted, value))
        }),
        "items" => value.as_array().is_none_or(|items| items.iter().all(|item| is_valid(wanted, item))),
        "minItems" => value.as_array().is_none_or(|items| items.len() as f64 >= number(wanted)),
        "maxItems" => value.as_array().is_none_or(|items| items.len() as f64 <= number(wanted)),
        "minimum" => value.as_f64().is_none_or(|value| value >= number(wanted)),
        "maximum" => value.as_f64().is_none_or(|value| value <= number(wanted)),
        "pattern" => value.as_str().is_none_or(|text| matches(wanted.as_str().unwrap(), text)),
        _ => unreachable!("the schema uses `{keyword}`"),
    }
}

fn is_of(kind: &Value, value: &Value) -> bool {
    match kind.as_str().unwrap() {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "null" => value.is_null(),
        "number" => value.is_number(),
        "integer" => value.is_i64() || value.is_u64(),
        other => unreachable!("the schema uses the type `{other}`"),
    }
}

/// The two patterns of the schema.
fn matches(pattern: &str, text: &str) -> bool {
    let is_hex = |text: &str| text.chars().all(|letter| letter.is_ascii_hexdigit());
    match pattern {
        "^[.#]*$" => text.chars().all(|letter| ".#".contains(letter)),
        "^([0-9a-fA-F]*|sha256:[0-9a-fA-F]{64}|fnv1a64:[0-9a-fA-F]{16})$" => match text.split_once(':') {
            None => is_hex(text),
            Some(("sha256", digits)) => digits.len() == 64 && is_hex(digits),
            Some(("fnv1a64", digits)) => digits.len() == 16 && is_hex(digits),
            Some(_) => false,
        },
        other => unreachable!("the schema uses the pattern `{other}`"),
    }
}
