//! Which planner, and how long it may think.

use std::time::Duration;

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, RangedU64ValueParser};
use pogema_core::Error;
use pogema_planners::{Budget, PlannerSettings, PolicySettings};

/// The names of planners, each with what it is good for.
pub fn names(known: &'static [(&'static str, &'static str)]) -> PossibleValuesParser {
    PossibleValuesParser::new(known.iter().map(|&(name, help)| PossibleValue::new(name).help(help)))
}

/// How long a planner may think, and on how many threads.
#[derive(Args, Clone, Debug)]
pub struct Thinking {
    /// Most time for a plan, in seconds; 1 if `--nodes` is not given either
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
    /// Most nodes that the search may look at: the same number gives the same plan on one thread
    #[arg(long, value_name = "N")]
    nodes: Option<u64>,
    /// Threads of the planner
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = RangedU64ValueParser::<usize>::new().range(1..=2))]
    threads: usize,
    /// Seed of the planner
    #[arg(long, value_name = "S", default_value_t = 0)]
    planner_seed: u64,
}

impl Thinking {
    /// What a planner is made with.
    pub fn choice(&self) -> PlannerSettings {
        PlannerSettings { seed: self.planner_seed, threads: self.threads }
    }

    /// What a policy is made with.
    pub fn settings(&self, future_goals: bool) -> Result<PolicySettings, Error> {
        let (budget, planner) = (self.budget()?, self.choice());
        Ok(PolicySettings { budget, planner, future_goals, ..PolicySettings::default() })
    }

    /// The budget for one plan.
    pub fn budget(&self) -> Result<Budget, Error> {
        let seconds = self.seconds.or(self.nodes.is_none().then_some(1.0));
        let time = |seconds: f64| {
            Duration::try_from_secs_f64(seconds)
                .map_err(|_| Error::config("seconds", seconds, "a time of 0 or more"))
        };
        Ok(Budget { time: seconds.map(time).transpose()?, nodes: self.nodes, cancelled: None })
    }
}
