//! Planners by the names under which the command line and Python know them.

use std::sync::Arc;

use pogema_core::Error;

use crate::cbs::{Cbs, CbsParams};
use crate::ecbs::{Ecbs, EcbsParams};
use crate::graph::Graph;
use crate::guide::GuideParams;
use crate::lacam::{Lacam, LacamParams};
use crate::lifelong::Lifelong;
use crate::pbs::{Pbs, PbsParams};
use crate::pibt::{Pibt, PibtLifelong, PibtParams};
use crate::problem::Planner;
use crate::rhcr::{Rhcr, RhcrParams};

/// What is chosen of a planner from outside, whichever it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice {
    /// Seed of all that it draws.
    pub seed: u64,
    /// Threads that it may use; one that can use fewer does.
    pub threads: usize,
}

impl Default for Choice {
    fn default() -> Self {
        Self { seed: 0, threads: 1 }
    }
}

/// The planners of problems with one goal for each agent, and what each is good for.
pub const PLANNERS: [(&str, &str); 5] = [
    ("lacam", "quick plans for any number of agents, made better until time is up"),
    ("pibt", "a plan of any quality at once, or none"),
    ("pbs", "good plans for some dozens of agents"),
    ("ecbs", "plans that cost at most 1.2 times the least, for few agents"),
    ("cbs", "the least cost for few agents or such as seldom meet, a bound on it for others"),
];

/// The planners of agents that get goal after goal, and what each is good for.
pub const LIFELONG: [(&str, &str); 3] = [
    ("rhcr", "plans some steps ahead, again and again"),
    ("pibt", "millions of steps a second"),
    ("guided-pibt", "around the traffic: for crowds in warehouses"),
];

/// A planner of problems with one goal for each agent.
///
/// # Errors
/// [`Error::Config`] for a name that is not in [`PLANNERS`].
pub fn planner(name: &str, choice: Choice) -> Result<Box<dyn Planner>, Error> {
    let Choice { seed, threads } = choice;
    Ok(match name {
        "lacam" => Box::new(Lacam::new(LacamParams { seed, threads, ..LacamParams::default() })),
        "pibt" => Box::new(Pibt::new(PibtParams { seed, ..PibtParams::default() })),
        "pbs" => Box::new(Pbs::new(PbsParams { seed })),
        "ecbs" => Box::new(Ecbs::new(EcbsParams { seed, ..EcbsParams::default() })),
        "cbs" => Box::new(Cbs::new(CbsParams { seed, ..CbsParams::default() })),
        _ => return Err(unknown(name, &PLANNERS)),
    })
}

/// A planner of agents that get goal after goal on a map.
///
/// # Errors
/// [`Error::Config`] for a name that is not in [`LIFELONG`].
pub fn lifelong(name: &str, graph: Arc<Graph>, choice: Choice) -> Result<Box<dyn Lifelong>, Error> {
    let seed = choice.seed;
    Ok(match name {
        "rhcr" => Box::new(Rhcr::new(graph, RhcrParams { seed, ..RhcrParams::default() })),
        "pibt" => Box::new(PibtLifelong::new(graph, 0, PibtParams { seed, ..PibtParams::default() })),
        "guided-pibt" => {
            let guide = Some(GuideParams::default());
            Box::new(PibtLifelong::new(graph, 0, PibtParams { seed, guide, ..PibtParams::default() }))
        }
        _ => return Err(unknown(name, &LIFELONG)),
    })
}

fn unknown(name: &str, known: &[(&str, &str)]) -> Error {
    let names: Vec<String> = known.iter().map(|(name, _)| format!("`{name}`")).collect();
    Error::config("planner", name, names.join(", "))
}
