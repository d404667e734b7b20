//! Random choices for making test cases.

use pogema_numpy::{Generator, SeedSequence};

/// Random choices for making test cases.
#[derive(Clone, Debug)]
pub(crate) struct Dice(Generator);

impl Dice {
    /// Dice for one case of a run.
    pub fn new(seed: u64, case: u64) -> Self {
        let words = [seed as u32, (seed >> 32) as u32, case as u32, (case >> 32) as u32];
        Self(Generator::from_sequence(&SeedSequence::from_words(&words)))
    }

    /// A number below `limit`.
    pub fn below(&mut self, limit: usize) -> usize {
        // INVARIANT: the range holds at least one number.
        self.0.integers(0, limit.max(1) as i64).unwrap_or_default() as usize
    }

    /// A number of a range, both ends included.
    pub fn between(&mut self, least: usize, most: usize) -> usize {
        least + self.below(most.saturating_sub(least) + 1)
    }

    /// Whether an event of this probability happens.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.0.random() < probability
    }

    /// One of a list.
    pub fn pick<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.below(list.len())]
    }

    /// A list in random order.
    pub fn shuffle<T>(&mut self, list: &mut [T]) {
        self.0.shuffle(list);
    }
}
