//! `pogema plan`: plans paths for all agents of an instance.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use clap::Args;
use pogema_conformance::files;
use pogema_core::{Episode, Error, Instance, Trace, Words};
use pogema_maps::GridConfig;
use pogema_planners::{Budget, Outcome, Plan, PlannerName, Problem, validate, write_plan, write_result};
use pogema_reference::Reference;
use serde_json::{Value, json};

use crate::interrupt::Interrupt;
use crate::output::{print_json, print_line, write_trace};
use crate::render::Pictures;
use crate::run::Settings;
use crate::words::word;

use super::planner_args::PlannerArgs;

#[derive(Args, Debug)]
pub struct MakePlan {
    #[command(flatten)]
    settings: Settings,
    /// Planner
    #[arg(long, value_name = "NAME", default_value_t = PlannerName::Lacam, value_parser = word::<PlannerName>())]
    planner: PlannerName,
    #[command(flatten)]
    planner_args: PlannerArgs,
    /// Write the plan to this file, one line of cells per step
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write a result file in the format of the LaCAM programs
    #[arg(long, value_name = "FILE")]
    result: Option<PathBuf>,
    /// Write the trace of the episode to this file as JSON lines; compressed if its name ends in `.zst`
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
    /// Print the outcome as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    pictures: Pictures,
}

impl MakePlan {
    /// Plans and writes the results; exit status 0 if a plan solves the instance, 1 if none exists or none was found.
    ///
    /// On Ctrl-C, the planner returns the best plan so far, and the exit status is 130.
    pub fn run(&self) -> Result<ExitCode, Error> {
        let config = self.settings.config()?;
        let others = [("--out", &self.out), ("--result", &self.result), ("--trace", &self.trace)];
        self.pictures.check(config.num_agents, &self.settings.inputs(), &others)?;
        let interrupt = Interrupt::watch()?;
        let budget = Budget { cancelled: Some(interrupt.flag()), ..self.planner_args.budget()? };
        let instance = self.settings.generate(&config)?.instance;
        let problem = Problem::of(&instance)?;
        let problem = match self.settings.max_steps()? {
            Some(max_steps) => problem.within(max_steps),
            None => problem,
        };
        let began = Instant::now();
        let outcome = self.planner.make(self.planner_args.planner_settings()).plan(&problem, &budget);
        let seconds = began.elapsed().as_secs_f64();
        if let Outcome::Solved { plan, .. } = &outcome {
            let goals = instance.first_goals();
            validate(instance.map(), instance.starts(), Some(&goals), plan).map_err(|conflict| {
                Error::Plan { reason: format!("`{}` returned an invalid plan: {conflict}", self.planner) }
            })?;
            self.write(&config, &instance, plan)?;
        }
        if let Some(path) = &self.result {
            // Without `--map`, the result names no map, and reading it requires the config or flags that made the map.
            let map = self.settings.map_argument().unwrap_or_default();
            let text = write_result(map, self.planner.word(), &problem, &outcome);
            files::write(path, text.as_bytes())?;
        }
        if self.json {
            print_json(&as_json(&outcome, seconds))?;
        } else {
            let note = if interrupt.status().is_some() { "interrupted: " } else { "" };
            print_line(&format!("{note}{outcome}; {seconds:.3} s"))?;
        }
        let status = if outcome.solution().is_some() { ExitCode::SUCCESS } else { ExitCode::FAILURE };
        Ok(interrupt.status().unwrap_or(status))
    }

    fn write(&self, config: &GridConfig, instance: &Instance, plan: &Plan) -> Result<(), Error> {
        if let Some(path) = &self.out {
            files::write(path, write_plan(plan).as_bytes())?;
        }
        if self.trace.is_none() && !self.pictures.are_requested() {
            return Ok(());
        }
        let trace = replay(config, instance, plan)?;
        if let Some(path) = &self.trace {
            write_trace(path, &trace)?;
        }
        if !self.pictures.are_requested() {
            return Ok(());
        }
        let title = self.settings.title().unwrap_or_else(|| "a random map".into());
        self.pictures.draw(&trace, &format!("{title}, planned by {}", self.planner))
    }
}

/// Plays a plan on the reference engine and returns the trace.
fn replay(config: &GridConfig, instance: &Instance, plan: &Plan) -> Result<Trace, Error> {
    let rules = pogema_core::Config {
        collision: pogema_core::Collision::Soft,
        on_goal: pogema_core::OnGoal::Nothing,
        max_steps: plan.num_steps() as i64,
        ..config.rules()
    };
    let mut episode = Episode::new(Reference::new(rules)?).with_recording();
    episode.start(instance.clone())?;
    for step in 0..plan.num_steps() {
        episode.step(&plan.actions(step)?)?;
    }
    episode.trace()
}

fn as_json(outcome: &Outcome, seconds: f64) -> Value {
    let mut json = match outcome {
        Outcome::Solved { plan, lower_bound } => json!({
            "outcome": "solved",
            "sum_of_costs": plan.sum_of_costs(),
            "lower_bound": lower_bound,
            "makespan": plan.makespan(),
        }),
        Outcome::TimedOut { lower_bound, .. } => json!({"outcome": "timed_out", "lower_bound": lower_bound}),
        Outcome::GaveUp { lower_bound, .. } => json!({"outcome": "gave_up", "lower_bound": lower_bound}),
        Outcome::Impossible { reason } => json!({"outcome": "impossible", "reason": reason}),
    };
    json["seconds"] = seconds.into();
    json
}
