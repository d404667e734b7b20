//! Ports that alter the answers of the reference: their form, their keys or their values.

use pogema_conformance::NamedEngine;
use pogema_conformance::port::{Ask, Hello, Key, Link, Misbehaviour, Reply, Server};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

/// The reference as a port, with functions that change its answers.
pub struct AlteredPort {
    server: Server,
    hello: fn(&mut Hello),
    reply: fn(&Ask, &mut Reply),
    last: Reply,
}

impl AlteredPort {
    pub fn boxed(hello: fn(&mut Hello), reply: fn(&Ask, &mut Reply)) -> Box<dyn Link> {
        Box::new(Self { server: Server::new(NamedEngine::REFERENCE), hello, reply, last: Reply::default() })
    }
}

impl Link for AlteredPort {
    fn hello(&mut self) -> Result<Hello, Misbehaviour> {
        let mut hello = self.server.hello()?;
        (self.hello)(&mut hello);
        Ok(hello)
    }

    fn ask(&mut self, ask: &Ask) -> Result<Reply, Misbehaviour> {
        match ask {
            Ask::Observe => {
                return Ok(Reply { observations: self.last.observations.clone(), ..Reply::default() });
            }
            Ask::Metrics => return Ok(Reply { metrics: self.last.metrics.clone(), ..Reply::default() }),
            _ => {}
        }
        let mut reply = self.server.ask(ask)?;
        self.last = reply.clone();
        (self.reply)(ask, &mut reply);
        Ok(reply)
    }
}

/// Leaves out observations and metrics, which can be requested separately.
pub fn terse(_: &Ask, reply: &mut Reply) {
    reply.observations = None;
    reply.metrics = Key::LeftOut;
}

/// Writes windows as numbers instead of digits.
pub fn in_numbers(_: &Ask, reply: &mut Reply) {
    change_windows(reply, |bits| json!(bits.chunks(3).collect::<Vec<_>>()));
}

fn sha256_of(bits: &[u8]) -> Value {
    let digits: Vec<String> = Sha256::digest(bits).iter().map(|byte| format!("{byte:02x}")).collect();
    format!("sha256:{}", digits.concat()).into()
}

pub fn in_sha256(_: &Ask, reply: &mut Reply) {
    change_windows(reply, sha256_of);
}

pub fn in_fnv(_: &Ask, reply: &mut Reply) {
    change_windows(reply, |bits| {
        let step = |hash: u64, &byte: &u8| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
        format!("fnv1a64:{:016x}", bits.iter().fold(0xcbf2_9ce4_8422_2325, step)).into()
    });
}

/// Writes hashes of windows whose last cell is wrong.
pub fn in_wrong_sha256(_: &Ask, reply: &mut Reply) {
    change_windows(reply, |bits| {
        let mut wrong = bits.to_vec();
        *wrong.last_mut().unwrap() ^= 1;
        sha256_of(&wrong)
    });
}

/// Writes 0.5 for each 1.
pub fn in_halves(_: &Ask, reply: &mut Reply) {
    change_windows(reply, |bits| {
        let values: Vec<f64> = bits.iter().map(|&bit| if bit == 1 { 0.5 } else { 0.0 }).collect();
        json!(values)
    });
}

fn change_windows(reply: &mut Reply, encode: fn(&[u8]) -> Value) {
    match &mut reply.observations {
        Some(Value::Array(windows)) => change(windows, 3, encode),
        Some(Value::Object(arrays)) => {
            for name in ["obstacles", "agents"] {
                change(arrays[name].as_array_mut().unwrap(), 1, encode);
            }
        }
        _ => {}
    }
}

fn change(windows: &mut [Value], num_channels: usize, encode: fn(&[u8]) -> Value) {
    for window in windows {
        let bits = bits(window.as_str().unwrap());
        // The digits are padded with zeros.
        let mut sizes = (1..).step_by(2).map(|side: usize| num_channels * side * side);
        let size = sizes.find(|size| size.div_ceil(8) * 8 == bits.len()).unwrap();
        *window = encode(&bits[..size]);
    }
}

fn bits(digits: &str) -> Vec<u8> {
    let digit = |letter: char| letter.to_digit(16).unwrap() as u8;
    digits.chars().flat_map(|letter| (0..4).rev().map(move |bit| digit(letter) >> bit & 1)).collect()
}
