//! The density of agents in the windows of the agents.

use serde::{Deserialize, Serialize};

/// The number of agents and free cells in one agent's window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seen {
    /// Number of marks in the agents window, including the observing agent's own mark if it has one.
    pub agents: u32,
    /// Number of cells without an obstacle.
    pub free_cells: u32,
}

/// Averages the share of free window cells that hold an agent, over agents and then over time.
///
/// Rule: metrics/density
///
/// Source: POGEMA 1.4.0, `wrappers/metrics.py`, `AgentsDensityWrapper`
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DensityMeter {
    means: Vec<f64>,
}

impl DensityMeter {
    /// Starts an episode.
    pub fn reset(&mut self) {
        self.means.clear();
    }

    /// Adds the windows of one frame. Call it after the reset, too.
    ///
    /// A window without a free cell counts as empty; POGEMA divides by zero there.
    pub fn feed(&mut self, seen: &[Seen]) {
        let share = |&Seen { agents, free_cells }: &Seen| match free_cells {
            0 => 0.0,
            free_cells => f64::from(agents) / f64::from(free_cells),
        };
        let shares: Vec<f64> = seen.iter().map(share).collect();
        self.means.push(pairwise_mean(&shares));
    }

    /// Returns the average so far.
    pub fn mean(&self) -> f64 {
        pairwise_mean(&self.means)
    }
}

/// Returns the mean. Adds the values in NumPy's order, because the last bits of a sum depend on the order.
///
/// Source: NumPy 1.26, `mean` of a contiguous float64 array
pub fn pairwise_mean(values: &[f64]) -> f64 {
    pairwise_sum(values) / values.len() as f64
}

fn pairwise_sum(values: &[f64]) -> f64 {
    const LANES: usize = 8;
    const BLOCK: usize = 128;
    if values.len() < LANES {
        return values.iter().fold(0.0, |sum, value| sum + value);
    }
    if values.len() > BLOCK {
        let half = values.len() / 2;
        let (left, right) = values.split_at(half - half % LANES);
        return pairwise_sum(left) + pairwise_sum(right);
    }
    let (chunks, rest) = values.as_chunks::<LANES>();
    let mut lane = chunks[0];
    for chunk in &chunks[1..] {
        for (sum, value) in lane.iter_mut().zip(chunk) {
            *sum += value;
        }
    }
    let sum = ((lane[0] + lane[1]) + (lane[2] + lane[3])) + ((lane[4] + lane[5]) + (lane[6] + lane[7]));
    rest.iter().fold(sum, |sum, value| sum + value)
}
