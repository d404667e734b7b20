//! POGEMA's random actions.

use pogema_core::Action;
use pogema_numpy::Generator;

/// Draws the actions of POGEMA's `sample_actions`.
///
/// Rule: seed/actions
pub fn sample(generator: &mut Generator, num_agents: usize) -> Vec<Action> {
    (0..num_agents).map(|_| random_action(generator)).collect()
}

pub(super) fn random_action(generator: &mut Generator) -> Action {
    // INVARIANT: the range from 0 to 4 is not empty, and each of its numbers is an action.
    let number = generator.integers(0, Action::ALL.len() as i64).unwrap_or_default();
    Action::ALL[number as usize]
}
