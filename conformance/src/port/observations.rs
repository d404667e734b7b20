//! Conversion of observations between the protocol and records.

use pogema_core::{Config, Observation, Observed, ObservedMapf, ObservedPomapf, Padded, counted};
use serde::Deserialize as _;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use crate::digits::{digits_of, pack, unpack};

/// Reads observations from an answer. An error describes what is wrong with their form.
///
/// Rule: observe/default, observe/pomapf, observe/mapf
pub fn read(answer: &Value, config: &Config, padded_dtype: &str) -> Result<Observed, String> {
    let area = config.side() * config.side();
    let mut odd = Vec::new();
    if config.observation == Observation::Default {
        let windows = windows("observations", answer, config.num_agents, 3 * area, &mut odd)?;
        return Ok(Observed::Default { dtype: "float32".into(), windows, odd });
    }
    let array = |name: &str| answer.get(name).ok_or_else(|| format!("`observations` has no `{name}`"));
    let places = |name: &str| pairs(name, array(name)?, config.num_agents);
    let pomapf = ObservedPomapf {
        dtype: "float32".into(),
        obstacles: windows("obstacles", array("obstacles")?, config.num_agents, area, &mut odd)?,
        agents: windows("agents", array("agents")?, config.num_agents, area, &mut odd)?,
        xy: places("xy")?,
        target_xy: places("target_xy")?,
        odd,
    };
    if config.observation == Observation::Pomapf {
        return Ok(Observed::Pomapf(pomapf));
    }
    let global_obstacles = match answer.get("global_obstacles").unwrap_or(&Value::Null) {
        Value::Null => None,
        rows => {
            let rows = serde_json::from_value(rows.clone())
                .map_err(|_| "`global_obstacles` is not a list of strings".to_owned())?;
            Some(Padded { dtype: padded_dtype.into(), rows })
        }
    };
    let (global_xy, global_target_xy) = (places("global_xy")?, places("global_target_xy")?);
    Ok(Observed::Mapf(ObservedMapf { pomapf, global_obstacles, global_xy, global_target_xy }))
}

/// Writes observations in the form of an answer.
pub fn write(observed: &Observed) -> Value {
    let arrays = |pomapf: &ObservedPomapf| {
        json!({
            "obstacles": pomapf.obstacles, "agents": pomapf.agents,
            "xy": pomapf.xy, "target_xy": pomapf.target_xy,
        })
    };
    match observed {
        Observed::Default { windows, .. } => json!(windows),
        Observed::Pomapf(pomapf) => arrays(pomapf),
        Observed::Mapf(mapf) => {
            let mut answer = arrays(&mapf.pomapf);
            answer["global_xy"] = json!(mapf.global_xy);
            answer["global_target_xy"] = json!(mapf.global_target_xy);
            answer["global_obstacles"] = json!(mapf.global_obstacles.as_ref().map(|padded| &padded.rows));
            answer
        }
    }
}

/// Replaces each hash of an expected window with that window, so that observations can be compared as a whole.
pub fn resolve_hashes(expected: &Observed, answer: &mut Observed, side: usize) {
    let area = side * side;
    match (expected, answer) {
        (Observed::Default { windows: one, .. }, Observed::Default { windows: other, .. }) => {
            resolve(one, other, 3 * area);
        }
        (Observed::Pomapf(one), Observed::Pomapf(other))
        | (
            Observed::Mapf(ObservedMapf { pomapf: one, .. }),
            Observed::Mapf(ObservedMapf { pomapf: other, .. }),
        ) => {
            resolve(&one.obstacles, &mut other.obstacles, area);
            resolve(&one.agents, &mut other.agents, area);
        }
        _ => {}
    }
}

fn resolve(expected: &[String], answer: &mut [String], num_values: usize) {
    for (expected, answer) in expected.iter().zip(answer) {
        let Some((algorithm, _)) = answer.split_once(':') else { continue };
        if hash(algorithm, unpack(expected).into_iter().take(num_values)).as_deref() == Some(answer) {
            answer.clone_from(expected);
        }
    }
}

/// Returns the hash of the values, one byte per value; none for an unknown algorithm.
fn hash(algorithm: &str, values: impl Iterator<Item = bool>) -> Option<String> {
    let bytes: Vec<u8> = values.map(u8::from).collect();
    match algorithm {
        "sha256" => Some(format!("sha256:{}", digits_of(Sha256::digest(&bytes)))),
        "fnv1a64" => Some(format!("fnv1a64:{:016x}", fnv1a64(&bytes))),
        _ => None,
    }
}

fn fnv1a64(bytes: &[u8]) -> u64 {
    const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
    const PRIME: u64 = 0x0100_0000_01b3;
    bytes.iter().fold(OFFSET, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(PRIME))
}

fn windows(
    name: &str,
    answer: &Value,
    num_agents: usize,
    num_values: usize,
    odd: &mut Vec<String>,
) -> Result<Vec<String>, String> {
    let list = answer.as_array().ok_or_else(|| format!("`{name}` is not a list"))?;
    if list.len() != num_agents {
        return Err(format!("`{name}` has length {}, expected {num_agents}, one for each agent", list.len()));
    }
    let window = |(agent, window): (usize, &Value)| {
        let odd = |what| odd.push(format!("`{name}` of agent {agent}: {what}"));
        read_window(window, num_values, odd).map_err(|what| format!("`{name}` of agent {agent} {what}"))
    };
    list.iter().enumerate().map(window).collect()
}

fn read_window(answer: &Value, num_values: usize, odd: impl FnMut(String)) -> Result<String, String> {
    let Some(text) = answer.as_str() else { return read_values(answer, num_values, odd) };
    let (digits, length) = match text.split_once(':') {
        Some(("sha256", digits)) => (digits, 64),
        Some(("fnv1a64", digits)) => (digits, 16),
        Some((other, _)) => {
            return Err(format!("has the unknown hash algorithm `{other}`, expected `sha256` or `fnv1a64`"));
        }
        None => (text, 2 * num_values.div_ceil(8)),
    };
    if digits.len() != length {
        return Err(format!("has {}, expected {length}", counted(digits.len(), "digit")));
    }
    match digits.chars().find(|digit| !digit.is_ascii_hexdigit()) {
        Some(digit) => Err(format!("contains `{digit}`, expected a hexadecimal digit")),
        None => Ok(text.to_ascii_lowercase()),
    }
}

/// Reads numbers nested to any depth. A number other than 0 and 1 is valid in form but a wrong answer.
fn read_values(answer: &Value, num_values: usize, mut odd: impl FnMut(String)) -> Result<String, String> {
    let mut bits = Vec::with_capacity(num_values);
    let mut rest = vec![answer];
    while let Some(value) = rest.pop() {
        match value {
            Value::Array(values) => rest.extend(values.iter().rev()),
            Value::Bool(flag) => bits.push(*flag),
            Value::Number(number) => {
                let number = number.as_f64().unwrap_or(f64::NAN);
                if number != 0.0 && number != 1.0 {
                    odd(format!("value {} is {number}", bits.len()));
                }
                bits.push(number != 0.0);
            }
            other => {
                return Err(format!("contains {other}, expected nested lists of numbers, or one string"));
            }
        }
    }
    if bits.len() == num_values {
        Ok(pack(&bits, |&bit| bit))
    } else {
        Err(format!("has {}, expected {num_values}", counted(bits.len(), "value")))
    }
}

fn pairs(name: &str, answer: &Value, num_agents: usize) -> Result<Vec<[i32; 2]>, String> {
    let pairs = Vec::<[i32; 2]>::deserialize(answer)
        .map_err(|_| format!("`{name}` is not a list of pairs of whole numbers"))?;
    if pairs.len() == num_agents {
        Ok(pairs)
    } else {
        Err(format!("`{name}` has length {}, expected {num_agents}, one for each agent", pairs.len()))
    }
}
