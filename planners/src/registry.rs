//! Planners by name, as the command line and Python know them.

use std::sync::Arc;

use pogema_core::Error;

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
    /// The limit on threads.
    pub threads: usize,
}

impl Default for PlannerSettings {
    fn default() -> Self {
        Self { seed: 0, threads: 1 }
    }
}

/// The names and descriptions of one-shot planners.
pub const PLANNERS: [(&str, &str); 5] = [
    ("lacam", "fast plans for any number of agents, refined until the budget is spent"),
    ("pibt", "a plan of any quality within milliseconds, or none"),
    ("pbs", "good plans for some dozens of agents"),
    ("ecbs", "plans within 1.2 times the least cost, for few agents"),
    ("cbs", "optimal plans for few or rarely interacting agents; otherwise a lower bound"),
];

/// The names and descriptions of lifelong planners.
pub const LIFELONG: [(&str, &str); 5] = [
    ("rhcr", "rolling-horizon planning, improved until the budget is spent"),
    ("pibt", "millions of steps a second"),
    ("guided-pibt", "PIBT with traffic guidance, for crowds in warehouses"),
    ("rhcr-pbs", "RHCR that plans each window by priority-based search, as in the paper"),
    ("rhcr-ecbs", "RHCR that plans each window by ECBS within 1.5 times the least cost"),
];

/// Makes a one-shot planner.
///
/// # Errors
/// [`Error::Config`] for a name that is not in [`PLANNERS`].
pub fn planner(name: &str, settings: PlannerSettings) -> Result<Box<dyn Planner>, Error> {
    let PlannerSettings { seed, threads } = settings;
    Ok(match name {
        "lacam" => Box::new(Lacam::new(LacamParams { seed, threads, ..LacamParams::default() })),
        "pibt" => Box::new(Pibt::new(PibtParams { seed, ..PibtParams::default() })),
        "pbs" => Box::new(Pbs::new(PbsParams { seed })),
        "ecbs" => Box::new(Ecbs::new(EcbsParams { seed, ..EcbsParams::default() })),
        "cbs" => Box::new(Cbs::new(CbsParams { seed, ..CbsParams::default() })),
        _ => return Err(unknown(name, &PLANNERS)),
    })
}

/// Makes a lifelong planner for a map.
///
/// # Errors
/// [`Error::Config`] for a name that is not in [`LIFELONG`].
pub fn lifelong(
    name: &str,
    graph: Arc<Graph>,
    settings: PlannerSettings,
) -> Result<Box<dyn Lifelong>, Error> {
    let seed = settings.seed;
    let rhcr =
        |graph, solver| Box::new(Rhcr::new(graph, RhcrParams { solver, seed, ..RhcrParams::default() }));
    Ok(match name {
        "rhcr" => rhcr(graph, WindowSolver::Lns),
        "rhcr-pbs" => rhcr(graph, WindowSolver::Pbs),
        "rhcr-ecbs" => rhcr(graph, WindowSolver::Ecbs { weight: 1.5 }),
        "pibt" => Box::new(PibtLifelong::new(graph, 0, PibtParams { seed, ..PibtParams::default() })),
        "guided-pibt" => {
            let guidance = Some(GuidanceParams::default());
            Box::new(PibtLifelong::new(graph, 0, PibtParams { seed, guidance, ..PibtParams::default() }))
        }
        _ => return Err(unknown(name, &LIFELONG)),
    })
}

fn unknown(name: &str, known: &[(&str, &str)]) -> Error {
    let names: Vec<String> = known.iter().map(|(name, _)| format!("`{name}`")).collect();
    Error::config("planner", name, names.join(", "))
}
