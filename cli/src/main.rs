//! `pogema`: run, check and inspect POGEMA episodes.

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

/// Multi-agent path finding by POGEMA 1.4.0's rules, bit for bit.
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
    /// Make a plan that brings every agent of an instance to its goal
    Plan(plan::MakePlan),
    /// Check anyone's plan: exit status 0 if it is valid
    Validate(plan::Validate),
    /// Look at maps, make, convert and judge them
    Maps(maps::Maps),
    /// Play all episodes of a suite, and keep their results
    Evaluate(evaluate::Evaluate),
    /// Show results as tables and plots
    Views(views::Views),
    /// Play an episode of results again: draw it, or write what happened
    Replay(replay::Replay),
    /// Draw a recorded episode
    Render(render::Render),
    /// Check that all engines follow the rules; exit status 0 only if they do
    Conform(conform::Conform),
    /// Answer the questions of `conform --port` on standard input, as a port of our own
    Port(port::Port),
    /// Measure the speed of this machine, and of POGEMA 1.4.0 beside it
    Bench(bench::Bench),
}

fn main() -> ExitCode {
    let arguments = match help::parse() {
        Ok(arguments) => arguments,
        Err(error) if is_mistake(&error) => {
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

/// Whether the arguments are wrong, and not a call for help or for the version.
fn is_mistake(error: &clap::Error) -> bool {
    error.use_stderr() && error.kind() != ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand
}
