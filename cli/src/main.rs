//! `pogema`: runs, checks and inspects POGEMA episodes.

#![forbid(unsafe_code)]
// `println!` escapes nothing and panics if the output is closed. Commands print through `output` instead.
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod bench;
mod conform;
mod evaluate;
mod help;
mod input;
mod interrupt;
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
use pogema_core::Error;

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
    /// Serve a built-in engine as a port: read the questions of `conform --port` from standard input and write answers
    /// to standard output
    Port(port::Port),
    /// Measure the speed of the engine on this machine, optionally against POGEMA 1.4.0
    Bench(bench::Bench),
}

fn main() -> ExitCode {
    run().unwrap_or_else(|error| {
        output::tell(&format!("error: {error}"));
        ExitCode::from(2)
    })
}

fn run() -> Result<ExitCode, Error> {
    let arguments = match help::parse() {
        Ok(Some(arguments)) => arguments,
        Ok(None) => return help::print_first_steps().map(|()| ExitCode::from(2)),
        Err(error) if is_usage_error(&error) => {
            output::tell_lines(error.to_string().trim_end());
            return Ok(ExitCode::from(2));
        }
        Err(help) => return print_help(&help),
    };
    let done = |()| ExitCode::SUCCESS;
    match arguments.command {
        Command::Run(run) => run.run().map(done),
        Command::Plan(plan) => plan.run(),
        Command::Validate(validate) => validate.run(),
        Command::Maps(maps) => maps.run().map(done),
        Command::Evaluate(evaluate) => evaluate.run().map(done),
        Command::Views(views) => views.run(),
        Command::Replay(replay) => replay.run().map(done),
        Command::Render(render) => render.run().map(done),
        Command::Conform(conform) => conform.run(),
        Command::Port(port) => port.run().map(done),
        Command::Bench(bench) => bench.run().map(done),
    }
}

/// Returns whether clap rejects the arguments. Help, the version and a missing subcommand are not usage errors.
fn is_usage_error(error: &clap::Error) -> bool {
    error.use_stderr() && error.kind() != ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand
}

/// Prints a help text or the version, and returns clap's exit status.
fn print_help(help: &clap::Error) -> Result<ExitCode, Error> {
    match help.print() {
        // A command without its subcommand prints help to standard error. If that fails, the text is lost, as in
        // `tell`.
        _ if help.use_stderr() => {}
        printed => output::check_printed(printed)?,
    }
    Ok(u8::try_from(help.exit_code()).map_or(ExitCode::FAILURE, ExitCode::from))
}
