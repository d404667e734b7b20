//! `pogema run`: plays one episode.

mod learned_args;
mod policy;
mod settings;

use std::path::PathBuf;

use clap::Args;
use pogema_core::{Episode, Error, Trace, counted};
use pogema_maps::GridConfig;
use pogema_reference::Reference;
use pogema_render::Ground;
use serde_json::json;

use crate::input::Input;
use crate::output::{in_one_line, is_closed, print_json, print_line, write_trace};
use crate::plan::PlannerArgs;
use crate::render::Pictures;
use learned_args::LearnedArgs;
use policy::ActionSource;
pub use settings::{Settings, only_map};

#[derive(Args, Debug)]
pub struct Run {
    #[command(flatten)]
    settings: Settings,
    /// Policy that chooses the actions
    #[arg(long, value_parser = policy::names(), default_value = "random")]
    policy: String,
    /// Actions for `--policy file`: a trace, or a file with a JSON list of action numbers per line
    #[arg(long, value_name = "FILE")]
    actions: Option<PathBuf>,
    #[command(flatten)]
    input: Input,
    #[command(flatten)]
    planner_args: PlannerArgs,
    #[command(flatten)]
    learned_args: LearnedArgs,
    /// Provide future goals to `--policy rhcr`, `rhcr-pbs` or `rhcr-ecbs`
    #[arg(long)]
    future_goals: bool,
    /// Draw every step in the terminal
    #[arg(long)]
    render: bool,
    /// Write the trace of the episode to this file as JSON lines; compressed if its name ends in `.zst`
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
    /// Print the summary as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    pictures: Pictures,
}

impl Run {
    pub fn run(&self) -> Result<(), Error> {
        let config = self.settings.config()?;
        let mut inputs = self.settings.inputs();
        inputs.extend(self.actions.as_deref().into_iter().chain(self.learned_args.weights()));
        self.pictures.check(config.num_agents, &inputs, &[("--trace", &self.trace)])?;
        self.planner_args.check_policy(&self.policy)?;
        let mut settings = self.planner_args.policy_settings(self.future_goals)?;
        settings.learned = self.learned_args.read(&self.policy)?;
        let generated = self.settings.generate(&config)?;
        let rules = config.rules();
        let mut episode = Episode::new(Reference::new(rules)?).with_density().with_collisions();
        let is_recorded = self.trace.is_some() || self.pictures.are_requested();
        episode.record(is_recorded);
        episode.start(generated.instance)?;
        let instance = episode.instance()?;
        let file = self.actions.as_deref().map(|path| (path, self.input.limit()));
        let mut policy = ActionSource::new(&self.policy, file, &settings, &config, instance)?;
        let mut screen = self.render.then(|| self.pictures.screen());
        loop {
            if let Some(screen) = &mut screen {
                let ground = Ground::new(episode.instance()?, rules.radius);
                screen.draw(ground, episode.num_steps() as usize, &episode.snapshot())?;
            }
            let has_lost_screen = screen.is_some() && is_closed() && !is_recorded;
            if episode.is_over() || has_lost_screen {
                break;
            }
            let Some(actions) = policy.act(&episode)? else { break };
            episode.step(&actions)?;
        }
        if is_recorded {
            self.write(&episode.trace()?)?;
        }
        self.print_summary(&config, &generated.warnings, &episode)
    }

    /// Writes and draws a recorded episode.
    fn write(&self, trace: &Trace) -> Result<(), Error> {
        if let Some(path) = &self.trace {
            write_trace(path, trace)?;
        }
        if self.pictures.are_requested() { self.pictures.draw(trace, &self.title()) } else { Ok(()) }
    }

    /// Returns a title: the map, the seed and the policy.
    fn title(&self) -> String {
        let words = [self.settings.title(), Some(self.policy.clone())];
        words.into_iter().flatten().collect::<Vec<_>>().join(", ")
    }

    fn print_summary(
        &self,
        config: &GridConfig,
        warnings: &[String],
        episode: &Episode<Reference>,
    ) -> Result<(), Error> {
        if self.json {
            let summary = json!({
                "config": config.to_value(),
                "policy": self.policy,
                "steps": episode.num_steps(),
                "ended": episode.is_over(),
                "metrics": episode.metrics(),
                "warnings": warnings,
            });
            return print_json(&summary);
        }
        let steps = counted(episode.num_steps() as usize, "step");
        print_line(&format!("{steps}  {}", in_one_line(episode.metrics().named())))
    }
}
