//! Comparison of random calls with an installed NumPy 1.26.
//!
//! `POGEMA_ORACLE_PYTHON=python cargo test -p pogema-numpy --test numpy_live`

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail by panicking")]

mod calls;

use std::collections::BTreeMap;
use std::io::Write;
use std::process::{Command, Stdio};

use pogema_numpy::Generator;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use calls::{Bits, Call, Run, Start};

const RUNS: usize = 6_000;
const CALLS_PER_RUN: usize = 40;
/// Minimum number of calls of each kind that NumPy must accept.
const CALLS_PER_KIND: usize = 10_000;
const CALLS_NEAR_THRESHOLDS: usize = 2_000;

#[derive(Serialize)]
struct Request<'a> {
    runs: &'a [Run],
    near: Vec<Call>,
}

#[derive(Deserialize)]
struct Reply {
    version: String,
    answers: Vec<Vec<Value>>,
    near: Vec<Run>,
}

#[test]
fn random_calls_match_a_live_numpy() {
    let mut source = Source(Generator::seeded(20_240_601));
    let runs: Vec<Run> = (0..RUNS).map(|_| source.run()).collect();
    let reply = ask_numpy(&Request { runs: &runs, near: vec![] });
    assert_eq!(reply.answers.len(), runs.len());
    let mut num_accepted = BTreeMap::<String, usize>::new();
    for (run, answers) in runs.into_iter().zip(reply.answers) {
        let run = Run { answers, ..run };
        run.replay("random calls");
        for (call, _) in run.calls.iter().zip(&run.answers).filter(|(_, answer)| !answer.is_null()) {
            *num_accepted.entry(kind(call)).or_default() += 1;
        }
    }
    assert_eq!(num_accepted.len(), Source::KINDS);
    assert!(num_accepted.values().all(|&number| number >= CALLS_PER_KIND), "{num_accepted:?}");
}

#[test]
fn outcomes_change_at_the_thresholds_of_a_live_numpy() {
    let mut source = Source(Generator::seeded(20_240_602));
    let mut near = Vec::new();
    for _ in 0..CALLS_NEAR_THRESHOLDS {
        near.push(Call::Binomial1 { p: source.probability() });
        near.push(Call::ChoiceWeighted { weights: source.weights() });
    }
    let reply = ask_numpy(&Request { runs: &[], near });
    assert!(reply.near.len() > 8 * CALLS_NEAR_THRESHOLDS);
    for run in reply.near {
        run.replay("near a threshold");
    }
}

fn kind(call: &Call) -> String {
    serde_json::to_value(call).unwrap()["call"].to_string()
}

fn ask_numpy(request: &Request) -> Reply {
    let hint = "set POGEMA_ORACLE_PYTHON to a Python that has NumPy 1.26";
    let Ok(python) = std::env::var("POGEMA_ORACLE_PYTHON") else { panic!("{hint}") };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/live.py");
    let child = Command::new(&python).arg(script).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
    let mut child = child.unwrap_or_else(|error| panic!("cannot run `{python}`: {error}; {hint}"));
    // The script reads all input before it writes, and closes its end of the pipe if it cannot start.
    let written = child.stdin.take().unwrap().write_all(&serde_json::to_vec(request).unwrap());
    let output = child.wait_with_output().unwrap();
    assert!(written.is_ok() && output.status.success(), "`{python}` failed: {}; {hint}", output.status);
    let reply: Reply = serde_json::from_slice(&output.stdout).unwrap();
    assert!(reply.version.starts_with("1.26"), "`{python}` has NumPy {}; {hint}", reply.version);
    reply
}

/// A source of random calls. Its generator is under test as well, but only determines which calls are made.
struct Source(Generator);

impl Source {
    const KINDS: usize = 13;

    fn run(&mut self) -> Run {
        let mut words: Vec<u32> = (0..self.pick(9)).map(|_| self.0.next_u32()).collect();
        if self.one_in(4) {
            words.push(0);
        }
        let calls = (0..CALLS_PER_RUN).map(|_| self.call()).collect();
        Run { start: Start::Words(words), calls, answers: vec![] }
    }

    fn call(&mut self) -> Call {
        match self.pick(Self::KINDS) {
            0 => Call::NextU32,
            1 => Call::NextU64,
            2 => Call::Random,
            3 => {
                let (one, other) = (self.double(), self.double());
                let swap = one.0 > other.0 && !self.one_in(20);
                if swap { Call::Uniform { lo: other, hi: one } } else { Call::Uniform { lo: one, hi: other } }
            }
            4 => self.with_range(|lo, hi| Call::Integers { lo, hi }),
            5 => {
                let n = self.pick(20);
                self.with_range(|lo, hi| Call::IntegersArray { lo, hi, n })
            }
            6 => Call::ChoiceIndex { n: self.length() },
            7 => Call::ChoiceWeighted { weights: self.weights() },
            8 => Call::ShuffleList { n: self.length() },
            9 => Call::ShuffleArray { n: self.length() },
            10 => Call::ShuffleRows { n: self.length() },
            11 => Call::Binomial1 { p: self.probability() },
            _ => Call::Binomial1Array { p: self.probability(), n: self.pick(50) },
        }
    }

    fn pick(&mut self, n: usize) -> usize {
        self.0.choice_index(n).unwrap()
    }

    fn one_in(&mut self, n: usize) -> bool {
        self.pick(n) == 0
    }

    fn length(&mut self) -> usize {
        let longest = if self.one_in(100) { 3000 } else { 40 };
        self.pick(longest)
    }

    /// Draws the ends of a range, near zero or anywhere. The width has any number of bits and is often next to a power
    /// of two.
    fn with_range(&mut self, make: impl FnOnce(i64, i64) -> Call) -> Call {
        let highest = 1_u64 << self.pick(64);
        let width = match self.pick(3) {
            0 => highest.saturating_add(self.pick(4) as u64),
            1 => highest - self.pick(2) as u64,
            _ => highest | self.0.next_u64() & (highest - 1),
        };
        let room = u64::MAX - width;
        let offset = if room == u64::MAX { self.0.next_u64() } else { self.0.next_u64() % (room + 1) };
        let near_zero = self.pick(10) as i64 - 5;
        let lo = match near_zero.checked_add_unsigned(width) {
            Some(_) if self.one_in(2) => near_zero,
            _ => i64::MIN.wrapping_add_unsigned(offset),
        };
        let hi = lo.wrapping_add_unsigned(width);
        if self.one_in(50) { make(hi, lo) } else { make(lo, hi) }
    }

    fn double(&mut self) -> Bits {
        const ODD: [f64; 7] = [0.0, -0.0, 1.0, f64::MAX, -f64::MAX, f64::INFINITY, f64::NAN];
        Bits(match self.pick(20) {
            0 => ODD[self.pick(ODD.len())],
            1 => f64::from_bits(self.0.next_u64()),
            2..11 => self.0.random() - 2.0,
            _ => self.0.random() * 10.0,
        })
    }

    fn probability(&mut self) -> Bits {
        const ODD: [f64; 8] = [-0.0, -0.1, 1.1, f64::NAN, f64::MIN_POSITIVE, 1e-17, 0.5, 1.0];
        let half = self.0.random() / 2.0;
        Bits(match self.pick(12) {
            0 => ODD[self.pick(ODD.len())],
            1 => 0.0,
            2 => 0.5,
            3 => 1.0,
            4..8 => 0.5 - half,
            _ => 0.5 + half,
        })
    }

    /// Draws weights that mostly sum to one, sometimes only nearly, and sometimes contain an invalid weight.
    fn weights(&mut self) -> Vec<Bits> {
        const ODD: [f64; 4] = [-1e-9, -1.0, f64::NAN, f64::INFINITY];
        let mut weights: Vec<f64> = (0..self.pick(10)).map(|_| self.0.random()).collect();
        if self.one_in(2) {
            weights.iter_mut().step_by(3).for_each(|weight| *weight = 0.0);
        }
        let sum: f64 = weights.iter().sum();
        let error = if self.one_in(4) { 1.0 + (self.0.random() - 0.5) * 8e-8 } else { 1.0 };
        for weight in &mut weights {
            *weight = *weight / sum * error;
        }
        if !weights.is_empty() && self.one_in(20) {
            let index = self.pick(weights.len());
            weights[index] = ODD[self.pick(ODD.len())];
        }
        weights.into_iter().map(Bits).collect()
    }
}
