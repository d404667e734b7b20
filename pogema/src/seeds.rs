//! The seeds of the episodes of many environments.

use pogema_core::Error;
use pogema_maps::random_sequence;
use pogema_numpy::SeedSequence;

/// Exclusive upper bound of the seeds, as POGEMA requires.
const SEED_BOUND: u64 = i64::MAX as u64;

/// The source of the seeds of an environment's episodes.
///
/// The seed of an episode depends only on the given seed, the number of the environment and the number of the episode.
/// If the map of attempt 0 has no room for all agents, the episode has the seed of the first attempt with room.
/// In NumPy, `first(key)` is `int(SeedSequence(seed, spawn_key=key).generate_state(1, uint64)[0]) % (2**63 - 1)`:
///
/// | given seed | episode 0 | episode e | attempt a > 0 at episode e |
/// | --- | --- | --- | --- |
/// | shared | `first((env, 0))` | `first((env, e))` | `first((env, e, a))` |
/// | own | the seed itself | `first((e,))` | `first((e, a))` |
#[derive(Clone, Copy, Debug)]
pub enum Seed {
    /// One seed for all environments.
    Shared(u64),
    /// The environment's own seed.
    Own(u64),
}

impl Seed {
    /// Returns a random seed for all environments, drawn by the operating system.
    ///
    /// # Errors
    /// If the operating system provides none.
    pub fn from_os() -> Result<Self, Error> {
        Ok(Self::Shared(first(&random_sequence()?)))
    }

    /// Returns POGEMA's seed of an episode whose map has room at the first attempt.
    pub fn of_episode(self, env: usize, episode: u64) -> u64 {
        self.of_attempt(env, episode, 0)
    }

    /// Returns the seed with which an attempt at an episode draws its map; attempts count from 0.
    pub fn of_attempt(self, env: usize, episode: u64, attempt: u64) -> u64 {
        let attempts = if attempt == 0 { &[][..] } else { &[attempt] };
        match self {
            Self::Shared(seed) => first(&spawned(seed, &[&[env as u64, episode], attempts])),
            Self::Own(seed) if episode == 0 && attempt == 0 => seed,
            Self::Own(seed) => first(&spawned(seed, &[&[episode], attempts])),
        }
    }
}

fn spawned(seed: u64, key: &[&[u64]]) -> SeedSequence {
    SeedSequence::spawned(seed, &key.concat())
}

fn first(sequence: &SeedSequence) -> u64 {
    let [state] = sequence.generate_state_u64();
    state % SEED_BOUND
}
