//! The parameters of LaCAM*.

use crate::pibt::PibtRules;

/// Parameters of [`crate::Lacam`].
#[derive(Clone, Debug)]
pub struct LacamParams {
    /// Seed of all random choices.
    pub seed: u64,
    /// Options of a PIBT step.
    pub pibt: PibtRules,
    /// Number of threads; all but the first only refine. With several threads, plans differ from run to run.
    pub threads: usize,
    /// Whether to refine the first plan.
    pub refine: bool,
    /// Number of consecutive failed attempts to refine a plan after which a planner without time and node limits stops.
    pub patience: u64,
    /// Byte budget of the nodes of one search; the tables of the refinement have a separate budget of the same size.
    /// Until the first plan is found, two searches may run, each with this budget. In addition, the costs to go take
    /// four bytes for each agent and free cell.
    pub max_bytes: usize,
}

impl Default for LacamParams {
    fn default() -> Self {
        Self {
            seed: 0,
            pibt: PibtRules::default(),
            threads: 1,
            refine: true,
            patience: 20_000,
            max_bytes: 256 << 20,
        }
    }
}
