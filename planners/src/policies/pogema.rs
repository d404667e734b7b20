//! POGEMA's policies with POGEMA's random numbers.

use pogema_core::Action;
use pogema_numpy::Generator;

use crate::policies::astar::AStarTeam;

/// Returns POGEMA's A* policy, in which every agent draws its random moves from a generator with seed 0.
///
/// Rule: policy/astar
pub fn pogema_team() -> AStarTeam {
    AStarTeam::new(Box::new(|| {
        let mut generator = Generator::seeded(0);
        Box::new(move || random_action(&mut generator))
    }))
}

/// Draws the actions of POGEMA's `sample_actions`.
///
/// Rule: seed/actions
pub fn sample(generator: &mut Generator, num_agents: usize) -> Vec<Action> {
    (0..num_agents).map(|_| random_action(generator)).collect()
}

fn random_action(generator: &mut Generator) -> Action {
    // INVARIANT: a range from 0 to 5 is never empty, and each of its numbers is an action.
    let number = generator.integers(0, Action::ALL.len() as i64).unwrap_or_default();
    Action::ALL[number as usize]
}
