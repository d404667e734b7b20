//! Random choices for generating test cases.

use pogema_numpy::{Generator, SeedSequence};

/// A source of random choices for generating test cases.
#[derive(Clone, Debug)]
pub(crate) struct Dice(Generator);

impl Dice {
    /// Creates the dice of one case of a run.
    pub fn new(seed: u64, case: u64) -> Self {
        let words = [seed as u32, (seed >> 32) as u32, case as u32, (case >> 32) as u32];
        Self(Generator::from_sequence(&SeedSequence::from_words(&words)))
    }

    /// Draws a number below `limit`.
    pub fn below(&mut self, limit: usize) -> usize {
        // INVARIANT: the range holds at least one number.
        self.0.integers(0, limit.max(1) as i64).unwrap_or_default() as usize
    }

    /// Draws a number from a range, both ends included.
    pub fn between(&mut self, least: usize, most: usize) -> usize {
        least + self.below(most.saturating_sub(least) + 1)
    }

    /// Draws whether an event of this probability occurs.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.0.random() < probability
    }

    /// Draws one element of a list.
    pub fn pick<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.below(list.len())]
    }

    /// Shuffles a list.
    pub fn shuffle<T>(&mut self, list: &mut [T]) {
        self.0.shuffle(list);
    }
}
