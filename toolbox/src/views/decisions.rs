//! The time that an algorithm takes for one decision: one action of one agent.

use super::options::NUM_AGENTS;
use crate::results::{NETWORK_TIME, RUNTIME, Row};

/// The titles of the columns of [`times`].
pub(super) const TITLES: [&str; 2] = ["planner µs", "network µs"];

/// Returns the mean time of a decision in an episode: first the time outside the network, then the time inside it.
///
/// Units: microseconds.
///
/// With `on_target: nothing`, every agent decides in each step of the episode, and `ep_length` is the number of steps.
/// A lifelong episode has as many steps as its config says. For other episodes, the number of decisions is unknown.
pub(super) fn times(row: &Row) -> [Option<f64>; 2] {
    let is_known = |name: &str| row.metric(name).is_some();
    let number = |name: &str| row.field(name)?.as_f64();
    let num_steps = if is_known("SoC") {
        row.metric("ep_length")
    } else {
        number("max_episode_steps").filter(|_| is_known("avg_throughput"))
    };
    let each = |seconds: Option<f64>| Some(1e6 * seconds? / (num_steps? * number(NUM_AGENTS)?));
    let network = row.metric(NETWORK_TIME);
    let rest = row.metric(RUNTIME).map(|all| all - network.unwrap_or(0.0));
    [each(rest), each(network)]
}
