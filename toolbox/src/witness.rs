//! How crowded an episode was, and what came of its moves: the figures for which every step has to be seen.

use pogema_core::{Action, Cell, CollisionMeter, DensityMeter, Environment as _, Error, Map};
use pogema_fast::{Engine, words_per_agent};

/// Sees every step of an episode.
#[derive(Clone, Debug, Default)]
pub struct Witness {
    density: DensityMeter,
    collisions: CollisionMeter,
    before: Vec<Cell>,
    active: Vec<bool>,
    windows: Vec<u64>,
}

impl Witness {
    /// Begins with an episode that was just reset.
    ///
    /// # Errors
    /// Before the first reset.
    pub fn begin(&mut self, engine: &Engine) -> Result<(), Error> {
        self.density.reset();
        self.collisions = CollisionMeter::default();
        self.look(engine)
    }

    /// Looks at the environment before a step.
    pub fn before(&mut self, engine: &Engine) {
        self.before.clear();
        self.before.extend_from_slice(engine.cells());
        self.active.clear();
        self.active.extend_from_slice(engine.active());
    }

    /// Who took part before the step.
    pub fn active(&self) -> &[bool] {
        &self.active
    }

    /// Looks at it after the step.
    ///
    /// # Errors
    /// If it was not looked at before the step, or for a wrong number of actions.
    pub fn after(&mut self, engine: &Engine, map: &Map, actions: &[Action]) -> Result<(), Error> {
        Error::check_length("actions", self.before.len(), actions.len())?;
        self.collisions.feed(map, &self.before, &self.active, actions, engine.cells());
        self.look(engine)
    }

    /// Agents per free cell of a window, the mean over agents and time.
    ///
    /// Rule: metrics/density
    pub fn density(&self) -> f64 {
        self.density.mean()
    }

    /// Moves that came to nothing.
    ///
    /// Rule: metrics/collisions
    pub fn collisions(&self) -> CollisionMeter {
        self.collisions
    }

    fn look(&mut self, engine: &Engine) -> Result<(), Error> {
        let config = engine.config();
        let (area, per_agent) = (config.side() * config.side(), words_per_agent(config.radius));
        self.windows.resize(config.num_agents * per_agent, 0);
        engine.observe_bits(0..config.num_agents, &mut self.windows)?;
        self.density.feed(self.windows.chunks_exact(per_agent).map(|words| {
            let free = area as u32 - ones(words, 0, area);
            (ones(words, area, 2 * area), free)
        }));
        Ok(())
    }
}

/// Number of bits set among those from `first` to before `end`.
fn ones(words: &[u64], first: usize, end: usize) -> u32 {
    let (head, tail) = (first / 64, end / 64);
    let below = |bit: usize| (1u64 << (bit % 64)) - 1;
    let whole: u32 = words[head..tail].iter().map(|word| word.count_ones()).sum();
    let last = if end.is_multiple_of(64) { 0 } else { (words[tail] & below(end)).count_ones() };
    whole + last - (words[head] & below(first)).count_ones()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ones_are_counted_within_their_bounds() {
        let words = [u64::MAX, 0b1011, u64::MAX];
        let is_set = |bit: usize| words[bit / 64] >> (bit % 64) & 1 == 1;
        for first in 0..190 {
            for end in first..=190 {
                let wanted = (first..end).filter(|&bit| is_set(bit)).count();
                assert_eq!(ones(&words, first, end) as usize, wanted, "{first}..{end}");
            }
        }
    }
}
