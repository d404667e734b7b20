//! Flags for the budget, threads and seed of a planner.

use clap::Args;
use pogema_core::Error;
use pogema_planners::{Budget, PlannerSettings};
use pogema_policies::{NamedPolicy, PolicySettings};

use crate::threads::{note_threads, number_of_threads};

/// Budget, threads and seed of a planner.
#[derive(Args, Clone, Debug)]
pub struct PlannerArgs {
    /// Time budget of one plan, in seconds [default: 1, or no limit if `--nodes` is given]
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
    /// Node budget of one plan; the meaning of a node depends on the planner. On one thread and without `--seconds`,
    /// the same budget gives the same plan [default: no limit]
    #[arg(long, value_name = "N")]
    nodes: Option<u64>,
    /// Maximum number of threads; LaCAM refines plans on all of them, and the policy MATS-LP searches on them
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = number_of_threads())]
    threads: usize,
    /// Seed of the planner; in `run`, also of the actions that a network draws
    #[arg(long, value_name = "S", default_value_t = 0)]
    planner_seed: u64,
}

impl PlannerArgs {
    pub fn planner_settings(&self) -> PlannerSettings {
        PlannerSettings { seed: self.planner_seed, threads: self.threads }
    }

    pub fn policy_settings(&self, future_goals: bool) -> Result<PolicySettings, Error> {
        let (budget, planner) = (self.budget()?, self.planner_settings());
        Ok(PolicySettings { budget, planner, future_goals, ..PolicySettings::default() })
    }

    /// Checks that a policy is a planner if a budget is given.
    pub fn check_policy(&self, policy: &str) -> Result<(), Error> {
        let flags = [("--seconds", self.seconds.is_some()), ("--nodes", self.nodes.is_some())];
        match flags.into_iter().find(|(_, is_given)| *is_given && !NamedPolicy::is_planner(policy)) {
            Some((flag, _)) => {
                let all = NamedPolicy::all();
                let planners: Vec<_> = all
                    .into_iter()
                    .map(|(name, _)| name)
                    .filter(|name| NamedPolicy::is_planner(name))
                    .collect();
                let planners = planners.join(", ");
                Err(Error::request(format!("`{flag}` needs a planner: `--policy` with one of {planners}")))
            }
            None => Ok(()),
        }
    }

    /// Returns the budget of one plan. Prints a note if the machine has fewer cores than threads.
    pub fn budget(&self) -> Result<Budget, Error> {
        note_threads(self.threads);
        let seconds = self.seconds.or(self.nodes.is_none().then_some(1.0));
        let time = |seconds: f64| {
            Budget::time_from(seconds).ok_or_else(|| Error::argument("--seconds", seconds, Budget::SECONDS))
        };
        Ok(Budget { time: seconds.map(time).transpose()?, nodes: self.nodes, cancelled: None })
    }
}
