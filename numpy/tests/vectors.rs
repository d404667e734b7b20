//! Comparison with the results of NumPy 1.26.4 in `data/vectors.json`.

#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]

mod calls;

use std::collections::BTreeMap;

use pogema_numpy::{Generator, SeedSequence};
use serde::Deserialize;

use calls::Run;

#[derive(Deserialize)]
struct Vectors {
    seeding: Vec<Seeding>,
    runs: BTreeMap<String, Vec<Run>>,
}

#[derive(Deserialize)]
struct Seeding {
    words: Vec<u32>,
    pool: [u32; 4],
    state_u32: [u32; 8],
    state_u64: [u64; 4],
}

fn vectors() -> Vectors {
    serde_json::from_str(include_str!("data/vectors.json")).unwrap()
}

#[test]
fn seeds_of_every_size_match_the_pool_and_state_of_numpy() {
    for Seeding { words, pool, state_u32, state_u64 } in vectors().seeding {
        let sequence = SeedSequence::from_words(&words);
        assert_eq!(sequence.pool(), pool, "{words:?}");
        assert_eq!(sequence.generate_state_u32(), state_u32, "{words:?}");
        assert_eq!(sequence.generate_state_u64(), state_u64, "{words:?}");
    }
}

#[test]
fn a_64_bit_seed_equals_a_seed_of_two_words() {
    for seed in [0, 1, 42, (1 << 31) - 1, 1 << 32, (1 << 63) - 2, u64::MAX] {
        let words = [seed as u32, (seed >> 32) as u32];
        let sequence = SeedSequence::from_words(&words);
        assert_eq!(SeedSequence::from_u64(seed), sequence);
        assert_eq!(Generator::seeded(seed), Generator::from_sequence(&sequence));
    }
}

#[test]
fn every_call_matches_numpy() {
    for (topic, runs) in vectors().runs {
        for run in runs {
            run.replay(&topic);
        }
    }
}
