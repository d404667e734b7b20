//! `pogema`: runs, checks and inspects POGEMA episodes.

#![forbid(unsafe_code)]

mod bench;
mod conform;
mod evaluate;
mod help;
mod maps;
mod output;
mod plan;
mod port;
mod render;
mod replay;
mod run;
mod threads;
mod views;
mod words;

use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{Parser, Subcommand};

/// Multi-agent pathfinding under the rules of POGEMA 1.4.0, bit for bit
#[derive(Debug, Parser)]
#[command(version, about)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Play one episode and print its metrics
    Run(run::Run),
    /// Plan paths that bring all agents of an instance to their goals
    Plan(plan::MakePlan),
    /// Validate a plan; exit status 0 only if it is valid
    Validate(plan::Validate),
    /// List, show, generate, convert and analyse maps
    Maps(maps::Maps),
    /// Play all episodes of a suite and store the results
    Evaluate(evaluate::Evaluate),
    /// Show results as tables and plots
    Views(views::Views),
    /// Replay an episode of an evaluation: draw it or write its trace
    Replay(replay::Replay),
    /// Draw a recorded episode
    Render(render::Render),
    /// Check that all engines, or ports, follow the rules; exit status 0 only if they do
    Conform(conform::Conform),
    /// Serve a built-in engine as a port: answer the requests of `conform --port` on standard input
    Port(port::Port),
    /// Measure the speed of the engine on this machine, optionally against POGEMA 1.4.0
    Bench(bench::Bench),
}

fn main() -> ExitCode {
    let arguments = match help::parse() {
        Ok(arguments) => arguments,
        Err(error) if is_usage_error(&error) => {
            eprintln!("{}", error.to_string().lines().next().unwrap_or_default());
            return ExitCode::from(2);
        }
        Err(help) => help.exit(),
    };
    let result = match arguments.command {
        Command::Run(run) => run.run().map(|()| ExitCode::SUCCESS),
        Command::Plan(plan) => plan.run(),
        Command::Validate(validate) => validate.run(),
        Command::Maps(maps) => maps.run().map(|()| ExitCode::SUCCESS),
        Command::Evaluate(evaluate) => evaluate.run().map(|()| ExitCode::SUCCESS),
        Command::Views(views) => views.run(),
        Command::Replay(replay) => replay.run().map(|()| ExitCode::SUCCESS),
        Command::Render(render) => render.run().map(|()| ExitCode::SUCCESS),
        Command::Conform(conform) => conform.run(),
        Command::Port(port) => port.run().map(|()| ExitCode::SUCCESS),
        Command::Bench(bench) => bench.run().map(|()| ExitCode::SUCCESS),
    };
    result.unwrap_or_else(|error| {
        eprintln!("error: {error}");
        ExitCode::from(2)
    })
}

/// Returns whether the arguments are wrong; requests for help or the version are not.
fn is_usage_error(error: &clap::Error) -> bool {
    error.use_stderr() && error.kind() != ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand
}
