//! The seeds of the episodes of many environments.

use pogema_core::Error;
use pogema_maps::random_sequence;
use pogema_numpy::SeedSequence;

/// Upper bound of the seeds, excluded, as POGEMA requires.
const SEEDS: u64 = i64::MAX as u64;

/// The source of the seeds of an environment's episodes.
///
/// The seed of an episode depends only on the given seed, the number of the environment and the number of the episode.
/// In NumPy, `first(key)` is `int(SeedSequence(seed, spawn_key=key).generate_state(1, uint64)[0]) % (2**63 - 1)`:
///
/// | given seed | episode 0 | episode e |
/// | --- | --- | --- |
/// | shared | `first((env, 0))` | `first((env, e))` |
/// | own | the seed itself | `first((e,))` |
#[derive(Clone, Copy, Debug)]
pub enum Seed {
    /// One seed for all environments.
    Shared(u64),
    /// The environment's own seed.
    Own(u64),
}

impl Seed {
    /// Returns a seed for all environments from the operating system.
    ///
    /// # Errors
    /// If the operating system provides none.
    pub fn from_os() -> Result<Self, Error> {
        Ok(Self::Shared(first(&random_sequence()?)))
    }

    /// Returns POGEMA's seed of an episode.
    pub fn of_episode(self, env: usize, episode: u64) -> u64 {
        match self {
            Self::Shared(seed) => first(&SeedSequence::spawned(seed, &[env as u64, episode])),
            Self::Own(seed) if episode == 0 => seed,
            Self::Own(seed) => first(&SeedSequence::spawned(seed, &[episode])),
        }
    }
}

fn first(sequence: &SeedSequence) -> u64 {
    let [state] = sequence.generate_state_u64();
    state % SEEDS
}
