//! Planners by name, for the command line and Python.

use std::sync::Arc;

use pogema_core::words;

use crate::cbs::{Cbs, CbsParams, Ecbs, EcbsParams};
use crate::graph::Graph;
use crate::lacam::{Lacam, LacamParams};
use crate::lifelong::Lifelong;
use crate::pbs::{Pbs, PbsParams};
use crate::pibt::{GuidanceParams, Pibt, PibtLifelong, PibtParams};
use crate::planner::Planner;
use crate::rhcr::{Rhcr, RhcrParams, WindowSolver};

/// The settings that all planners share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlannerSettings {
    /// Seed of all random choices.
    pub seed: u64,
    /// Maximum number of threads. Of the planners, only LaCAM* uses more than one, and its plans then differ
    /// from run to run.
    pub threads: usize,
}

impl Default for PlannerSettings {
    fn default() -> Self {
        Self { seed: 0, threads: 1 }
    }
}

words! {
    /// The one-shot planners.
    pub enum PlannerName {
        /// Fast plans for any number of agents, refined until the budget is spent.
        Lacam = "lacam",
        /// A plan within milliseconds, or none; no quality guarantee.
        Pibt = "pibt",
        /// Good plans for a few dozen agents.
        Pbs = "pbs",
        /// Plans within 1.2 times the least cost, for few agents.
        Ecbs = "ecbs",
        /// Optimal plans for few or rarely interacting agents; otherwise a lower bound.
        Cbs = "cbs",
    }
}

words! {
    /// The lifelong planners.
    pub enum LifelongName {
        /// Rolling-horizon planning, improved within the budget.
        Rhcr = "rhcr",
        /// Fast steps without a quality guarantee: millions of agent steps per second.
        Pibt = "pibt",
        /// PIBT with traffic guidance, for crowded warehouses.
        GuidedPibt = "guided-pibt",
        /// RHCR that plans each window by priority-based search, as in the paper.
        RhcrPbs = "rhcr-pbs",
        /// RHCR that plans each window by ECBS within 1.5 times the least cost.
        RhcrEcbs = "rhcr-ecbs",
    }
}

impl PlannerName {
    /// Makes the planner.
    pub fn make(self, settings: PlannerSettings) -> Box<dyn Planner> {
        let PlannerSettings { seed, threads } = settings;
        match self {
            Self::Lacam => Box::new(Lacam::new(LacamParams { seed, threads, ..LacamParams::default() })),
            Self::Pibt => Box::new(Pibt::new(PibtParams { seed, ..PibtParams::default() })),
            Self::Pbs => Box::new(Pbs::new(PbsParams { seed })),
            Self::Ecbs => Box::new(Ecbs::new(EcbsParams { seed, ..EcbsParams::default() })),
            Self::Cbs => Box::new(Cbs::new(CbsParams { seed, ..CbsParams::default() })),
        }
    }
}

impl LifelongName {
    /// Makes the planner for a map.
    pub fn make(self, graph: Arc<Graph>, settings: PlannerSettings) -> Box<dyn Lifelong> {
        let seed = settings.seed;
        let rhcr =
            |graph, solver| Box::new(Rhcr::new(graph, RhcrParams { solver, seed, ..RhcrParams::default() }));
        let pibt = |graph, guidance| {
            Box::new(PibtLifelong::new(graph, PibtParams { seed, guidance, ..PibtParams::default() }))
        };
        match self {
            Self::Rhcr => rhcr(graph, WindowSolver::Lns),
            Self::RhcrPbs => rhcr(graph, WindowSolver::Pbs),
            Self::RhcrEcbs => rhcr(graph, WindowSolver::Ecbs { weight: 1.5 }),
            Self::Pibt => pibt(graph, None),
            Self::GuidedPibt => pibt(graph, Some(GuidanceParams::default())),
        }
    }
}
