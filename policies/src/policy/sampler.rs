//! The choice of actions from logits.

use pogema_core::{Action, Error};
use pogema_numpy::{Generator, SeedSequence};
use rand_mt::Mt;

use crate::network::{Sampling, softmax};

/// The number of actions, and of logits.
pub(crate) const NUM_ACTIONS: usize = Action::ALL.len();

/// The logits of an agent. A forbidden action has negative infinity.
pub(crate) type Logits = [f32; NUM_ACTIONS];

/// Chooses the actions of all agents of an episode.
#[derive(Clone, Debug)]
pub(crate) enum Sampler {
    /// One stream for each agent, which does not depend on other agents.
    Softmax(Vec<Generator>),
    /// One stream for all agents, and the random number of the current step.
    Follower(Box<Mt>, f64),
    Greedy,
}

impl Sampler {
    /// Creates the streams of an episode.
    ///
    /// # Errors
    /// [`Error::Argument`] if the rule is `follower` and the seed exceeds 32 bits, the seed size of its generator.
    pub fn new(rule: Sampling, seed: u64, num_agents: usize) -> Result<Self, Error> {
        let stream = |agent| Generator::from_sequence(&SeedSequence::spawned(seed, &[agent]));
        Ok(match rule {
            Sampling::Softmax => Self::Softmax((0..num_agents as u64).map(stream).collect()),
            Sampling::Follower => {
                let expected = || format!("at most {} for the sampling rule `follower`", u32::MAX);
                let seed = u32::try_from(seed).map_err(|_| Error::argument("seed", seed, expected()))?;
                Self::Follower(Box::new(Mt::new(seed)), 0.0)
            }
            Sampling::Greedy => Self::Greedy,
        })
    }

    /// Begins a step.
    pub fn begin_step(&mut self) {
        if let Self::Follower(twister, uniform) = self {
            *uniform = canonical(twister);
        }
    }

    /// Chooses the action of an agent.
    pub fn choose(&mut self, agent: usize, logits: Logits) -> Action {
        let index = match self {
            Self::Softmax(streams) => drawn(logits, streams[agent].random()),
            Self::Follower(_, uniform) => drawn_as_follower(logits, *uniform),
            Self::Greedy => greedy(logits),
        };
        Action::ALL[index]
    }
}

/// Returns the first action with the largest logit.
fn greedy(logits: Logits) -> usize {
    (1..NUM_ACTIONS).fold(0, |best, next| if logits[next] > logits[best] { next } else { best })
}

/// Returns the first action whose running sum of probabilities exceeds a number from 0 to 1.
fn drawn(mut logits: Logits, uniform: f64) -> usize {
    softmax(&mut logits);
    let aim = uniform * logits.iter().map(|&share| f64::from(share)).sum::<f64>();
    let mut sum = 0.0;
    let exceeds = |&share: &f32| {
        sum += f64::from(share);
        aim < sum
    };
    // If rounding makes `aim` too large for every action, the most probable action is returned.
    logits.iter().position(exceeds).unwrap_or_else(|| greedy(logits))
}

/// Returns the action as libstdc++'s `discrete_distribution` chooses it, with whole numbers as weights.
///
/// Source: Follower, `follower_cpp/NN_module.h`; GCC 13, `bits/random.tcc`
fn drawn_as_follower(logits: Logits, uniform: f64) -> usize {
    let mut shares = logits.map(libm::expf);
    let sum: f32 = shares.iter().sum();
    if sum.is_finite() && sum > 0.0 {
        shares = shares.map(|share| share / sum);
    } else {
        // The authors' code has no defined result here.
        shares = logits;
        softmax(&mut shares);
    }
    let weights = shares.map(|share| (f64::from(share) * 1e6).trunc());
    let total: f64 = weights.iter().sum();
    let mut running = 0.0;
    let reaches = |&weight: &f64| {
        running += weight / total;
        running >= uniform
    };
    // The last running sum counts as 1.
    weights[..NUM_ACTIONS - 1].iter().position(reaches).unwrap_or(NUM_ACTIONS - 1)
}

/// Returns a number from 0 up to, but not including, 1, as libstdc++'s `generate_canonical` for `double` does.
fn canonical(twister: &mut Mt) -> f64 {
    let (low, high) = (f64::from(twister.next_u32()), f64::from(twister.next_u32()));
    let uniform = (low + high * 4_294_967_296.0) / 18_446_744_073_709_551_616.0;
    uniform.min(1.0_f64.next_down())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may panic")]

    use super::*;

    #[test]
    fn a_seed_that_the_authors_generator_cannot_take_is_rejected() {
        assert!(Sampler::new(Sampling::Follower, u32::MAX.into(), 1).is_ok());
        let error = Sampler::new(Sampling::Follower, 1 << 32, 1).unwrap_err().to_string();
        assert_eq!(
            error,
            "`seed` is `4294967296`, expected at most 4294967295 for the sampling rule `follower`"
        );
        assert!(Sampler::new(Sampling::Softmax, 1 << 32, 1).is_ok());
    }

    #[test]
    fn the_twister_is_that_of_the_standard() {
        // The C++ standard requires this 10000th number of `mt19937`, whose default seed is 5489.
        let mut twister = Mt::new(5489);
        let last = (0..10_000).map(|_| twister.next_u32()).last();
        assert_eq!(last, Some(4_123_659_995));
        // The first numbers of seed 0, as NumPy's `RandomState(0)` draws them.
        let mut twister = Mt::new(0);
        assert_eq!([twister.next_u32(), twister.next_u32()], [2_357_136_044, 2_546_248_239]);
        let expected = (2_357_136_044.0 + 2_546_248_239.0 * 2.0_f64.powi(32)) / 2.0_f64.powi(64);
        assert_eq!(canonical(&mut Mt::new(0)), expected);
    }

    #[test]
    fn draws_follow_the_probabilities() {
        let shares = [0.1, 0.2, 0.3, 0.4, 0.0_f32];
        let logits = shares.map(f32::ln);
        for (uniform, expected) in [(0.0, 0), (0.0999, 0), (0.1001, 1), (0.5, 2), (0.61, 3), (0.999_999, 3)] {
            assert_eq!(drawn(logits, uniform), expected, "{uniform}");
            assert_eq!(drawn_as_follower(logits, uniform), expected, "{uniform}");
        }
        // A forbidden action is never drawn, even at the ends of the range.
        let forbidden = [f32::NEG_INFINITY, 1.0, f32::NEG_INFINITY, 1.0, f32::NEG_INFINITY];
        for (uniform, expected) in [(0.0, 1), (0.49, 1), (0.51, 3), (1.0_f64.next_down(), 3)] {
            assert_eq!(drawn(forbidden, uniform), expected, "{uniform}");
        }
        assert_eq!(greedy([1.0, 3.0, 3.0, 2.0, f32::NEG_INFINITY]), 1);
    }

    #[test]
    fn large_logits_do_not_overflow() {
        let logits = [1000.0, 0.0, 999.0, -1000.0, 0.0];
        assert_eq!(drawn(logits, 0.5), 0);
        assert_eq!(drawn_as_follower(logits, 0.5), 0);
        assert_eq!(drawn_as_follower(logits, 0.9), 2);
    }

    #[test]
    fn small_logits_do_not_underflow() {
        let logits = [-200.0, -1000.0, -200.0, f32::NEG_INFINITY, f32::NEG_INFINITY];
        for (uniform, expected) in [(0.1, 0), (0.4, 0), (0.6, 2), (0.9, 2)] {
            assert_eq!(drawn(logits, uniform), expected, "{uniform}");
            assert_eq!(drawn_as_follower(logits, uniform), expected, "{uniform}");
        }
    }

    #[test]
    fn a_stream_depends_on_seed_and_agent_alone() {
        let draws = |seed, num_agents, agents: &[usize]| -> Vec<Action> {
            let mut sampler = Sampler::new(Sampling::Softmax, seed, num_agents).unwrap();
            let mut all = Vec::new();
            for _ in 0..32 {
                sampler.begin_step();
                all.extend(agents.iter().map(|&agent| sampler.choose(agent, [0.0; NUM_ACTIONS])));
            }
            all
        };
        assert_eq!(draws(7, 2, &[1]), draws(7, 9, &[1]));
        assert_ne!(draws(7, 2, &[1]), draws(7, 2, &[0]));
        assert_ne!(draws(7, 2, &[1]), draws(8, 2, &[1]));
    }
}
