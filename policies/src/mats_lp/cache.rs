//! The outputs of the network for states that a search has already evaluated.

use std::sync::{Mutex, PoisonError};

use pogema_core::{Action, Cell};
use rustc_hash::{FxBuildHasher, FxHashMap};
use std::hash::BuildHasher;

/// The values that determine the network's input for one agent, and no others.
///
/// The window of costs depends on the cell and the goal. Its centre depends on the difference between the cost and the
/// smallest cost so far. The window of agents depends on the marks. Two agents with the same key therefore have the
/// same input, even in different groups.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Key {
    marks: [u64; 4],
    cell: Cell,
    goal: Cell,
    behind: u8,
}

impl Key {
    /// Largest radius of a window whose marks fit.
    pub const LARGEST_RADIUS: usize = 7;

    pub fn new(cell: Cell, goal: Cell, behind: u8) -> Self {
        Self { marks: [0; 4], cell, goal, behind }
    }

    /// Marks a cell of the window, given by its index.
    pub fn mark(&mut self, index: usize) {
        self.marks[index / 64] |= 1 << (index % 64);
    }

    /// Returns whether a cell of the window is marked.
    pub fn is_marked(&self, index: usize) -> bool {
        self.marks[index / 64] >> (index % 64) & 1 == 1
    }
}

/// The outputs of the network that a search reads: the probability of each action, and the critic's value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Prediction {
    pub probabilities: [f32; Action::ALL.len()],
    pub value: f32,
}

/// A cache that all threads share. Evicting an entry changes the running time, never a result.
#[derive(Debug)]
pub(super) struct Cache {
    shards: Vec<Mutex<Shard>>,
}

/// Two generations of entries: those of the older one are evicted when the newer one is full.
#[derive(Debug, Default)]
struct Shard {
    newer: FxHashMap<Key, Prediction>,
    older: FxHashMap<Key, Prediction>,
}

impl Cache {
    const NUM_SHARDS: usize = 16;
    /// Entries of one generation of a shard. Both generations of all shards take about 40 MB.
    const MAX_ENTRIES: usize = 1 << 13;

    /// Creates an empty cache.
    pub fn new() -> Self {
        Self { shards: (0..Self::NUM_SHARDS).map(|_| Mutex::default()).collect() }
    }

    fn shard(&self, key: &Key) -> std::sync::MutexGuard<'_, Shard> {
        // The map uses the upper and the lowest bits of the hash.
        let index = (FxBuildHasher.hash_one(key) >> 32) as usize % Self::NUM_SHARDS;
        // A panic cannot leave an entry half written.
        self.shards[index].lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the prediction of a key, if it is known.
    pub fn get(&self, key: &Key) -> Option<Prediction> {
        let mut shard = self.shard(key);
        if let Some(&known) = shard.newer.get(key) {
            return Some(known);
        }
        let known = shard.older.get(key).copied()?;
        shard.insert(*key, known);
        Some(known)
    }

    /// Adds the prediction of a key.
    pub fn insert(&self, key: Key, prediction: Prediction) {
        self.shard(&key).insert(key, prediction);
    }
}

impl Shard {
    fn insert(&mut self, key: Key, prediction: Prediction) {
        if self.newer.len() >= Cache::MAX_ENTRIES {
            std::mem::swap(&mut self.newer, &mut self.older);
            self.newer.clear();
        }
        self.newer.insert(key, prediction);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cache_keeps_recent_entries_within_its_limit() {
        let cache = Cache::new();
        let key = |number: usize| {
            Key::new(Cell::new((number / 100) as u16, (number % 100) as u16), Cell::new(0, 0), 1)
        };
        let prediction = |number: usize| Prediction { probabilities: [0.2; 5], value: number as f32 };
        let count = 4 * Cache::NUM_SHARDS * Cache::MAX_ENTRIES;
        for number in 0..count {
            cache.insert(key(number), prediction(number));
            assert_eq!(cache.get(&key(number)), Some(prediction(number)));
            assert_eq!(cache.get(&key(0)), Some(prediction(0)), "used in every turn");
        }
        assert_eq!(cache.get(&key(1)), None);
        let held =
            |shard: &Mutex<Shard>| shard.lock().map_or(0, |shard| shard.newer.len() + shard.older.len());
        let num_held: usize = cache.shards.iter().map(held).sum();
        assert!(num_held <= 2 * Cache::NUM_SHARDS * Cache::MAX_ENTRIES);
        assert!(
            num_held > Cache::NUM_SHARDS * Cache::MAX_ENTRIES / 2,
            "the shards are not used evenly: {num_held}"
        );
    }
}
