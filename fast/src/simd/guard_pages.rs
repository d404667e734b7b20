//! Tests that no path reads or writes beyond its slices: values beside a slice stay unchanged, and an access to a guard
//! page ends the process.
//!
//! A sanitizer does not see the stores that bypass the cache, because they are assembly.

use pogema_core::{Cell, Config, Environment, GoalStream, Instance, Map, Outside, SimdPath};

use super::guarded::{Guarded, Side};
use super::sealed::Spread;
use super::{Value, lead_of};
use crate::{Engine, words_per_agent};

/// Numbers of values between a slice and its guard page. A stray store that ends before the page changes these values.
const DISTANCES: [usize; 9] = [0, 1, 2, 5, 8, 15, 16, 33, 63];

fn check<V: Value + Spread>(path: SimdPath, canary: V) {
    let (mut bits, mut values) = (Guarded::new(1), Guarded::new(2));
    for len in (1..300).chain([511, 512, 513, 1000]) {
        for (side, distance) in
            [Side::Start, Side::End].into_iter().flat_map(|side| DISTANCES.map(|at| (side, at)))
        {
            let all = values.slice(side, len + distance, canary);
            let (first, last) = match side {
                Side::Start => (distance, distance + len),
                Side::End => (0, len),
            };
            let lead = lead_of(&all[first..]);
            for words_side in [Side::Start, Side::End] {
                let words = bits.slice(words_side, (lead + len).div_ceil(64), 0_u64);
                for (index, word) in words.iter_mut().enumerate() {
                    *word = 0x9e37_79b9_7f4a_7c15_u64.rotate_left(index as u32 * 7);
                }
                let mut expected = vec![canary; all.len()];
                V::spread(SimdPath::Scalar, words, lead, &mut expected[first..last], false);
                for streaming in [false, true] {
                    all.fill(canary);
                    V::spread(path, words, lead, &mut all[first..last], streaming);
                    assert_eq!(
                        all, expected,
                        "{path}, {len} values at a distance of {distance} from the {side:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn spread_stays_inside_its_slices() {
    for path in SimdPath::available() {
        check::<f32>(path, 7.0);
        check::<u8>(path, 7);
    }
}

/// Returns an engine with an agent on every free cell of a map.
fn engine(radius: usize, path: SimdPath) -> Engine {
    const SIDE: u16 = 7;
    let obstacles = (0..usize::from(SIDE * SIDE)).map(|cell| cell % 5 == 1).collect();
    let map = Map::new(usize::from(SIDE), usize::from(SIDE), obstacles).unwrap();
    let free = |row: u16, col: u16| !map.is_obstacle(Cell::new(row, col));
    let cells = (0..SIDE).flat_map(|row| (0..SIDE).map(move |col| (row, col)));
    let starts: Vec<Cell> =
        cells.filter(|&(row, col)| free(row, col)).map(|(row, col)| Cell::new(row, col)).collect();
    let goals: Vec<_> = starts.iter().rev().copied().map(GoalStream::single).collect();
    let config = Config { num_agents: starts.len(), radius, ..Config::default() };
    let mut engine = Engine::with_path(config, path).unwrap();
    engine.reset(&Instance::new(map, Outside::Free, starts, goals).unwrap()).unwrap();
    engine
}

#[test]
fn windows_stay_inside_their_buffers() {
    let (mut packed, mut spread) = (Guarded::new(4), Guarded::new(64));
    for radius in [1, 2, 3, 4, 5, 6, 8] {
        let (of_words, of_values) = (words_per_agent(radius), 3 * (2 * radius + 1) * (2 * radius + 1));
        let plain = engine(radius, SimdPath::Scalar);
        let num_agents = plain.state().cells.len();
        for path in SimdPath::available() {
            let engine = engine(radius, path);
            for agents in [0..1, 1..2, 0..num_agents / 2, num_agents - 9..num_agents, 0..num_agents] {
                for side in [Side::Start, Side::End] {
                    let words = packed.slice(side, agents.len() * of_words, u64::MAX);
                    engine.observe_bits(agents.clone(), words).unwrap();
                    let mut expected = vec![0; words.len()];
                    plain.observe_bits(agents.clone(), &mut expected).unwrap();
                    assert_eq!(words, expected, "{path}, radius {radius}, agents {agents:?} at the {side:?}");
                    let values = spread.slice(side, agents.len() * of_values, 7.0_f32);
                    engine.observe_agents(agents.clone(), values).unwrap();
                    let mut expected = vec![0.0; values.len()];
                    plain.observe_agents(agents.clone(), &mut expected).unwrap();
                    assert_eq!(
                        values, expected,
                        "{path}, radius {radius}, agents {agents:?} at the {side:?}"
                    );
                }
            }
        }
    }
}
