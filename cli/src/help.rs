//! The help texts: examples below each command's options, and the first steps for `pogema` without arguments.

use clap::{Command, CommandFactory, FromArgMatches};
use pogema_core::Error;

use crate::Arguments;
use crate::output::print_bytes;

/// Printed if the program is called without arguments.
const FIRST_STEPS: &str = "\
Multi-agent pathfinding under the rules of POGEMA 1.4.0, bit for bit.

Watch an episode in the terminal:
  pogema run --map four-rooms --num-agents 6 --seed 1 --policy astar --render

Plan with LaCAM and replay the result in a browser:
  pogema plan --map four-rooms --num-agents 6 --seed 1 --nodes 20000 --html plan.html

Check your own implementation, in any language:
  pogema conform --port 'python3 adapter.py'

`pogema --help` lists all commands; `pogema COMMAND --help` explains one.
";

/// Examples by command. A test runs them in this order, in one folder that holds `config.yaml`, `suite.yaml` and
/// `adapter.py`.
const EXAMPLES: &[(&str, &[&str])] = &[
    (
        "run",
        &[
            "pogema run --map four-rooms --num-agents 6 --seed 1 --policy astar --render",
            "pogema run config.yaml --policy lacam --nodes 5000 --html episode.html",
            "pogema run --size 16 --num-agents 8 --seed 1 --trace episode.jsonl.zst --json",
        ],
    ),
    (
        "plan",
        &[
            "pogema plan --map four-rooms --num-agents 8 --seed 1 --nodes 20000 --out plan.txt",
            "pogema plan --map puzzle-crossroads --planner cbs --seconds 5 --html plan.html",
        ],
    ),
    ("validate", &["pogema validate plan.txt --map four-rooms --num-agents 8 --seed 1"]),
    ("maps list", &["pogema maps list 'puzzle-.*'"]),
    ("maps show", &["pogema maps show four-rooms", "pogema maps show puzzle-lobby --svg lobby.svg"]),
    (
        "maps generate",
        &[
            "pogema maps generate validation-mazes --out mazes.yaml",
            "pogema maps generate random --seeds 0..16 --width-min 32 --width-max 32 --out random.yaml",
        ],
    ),
    ("maps export", &["pogema maps export four-rooms --to map --out four-rooms.map"]),
    ("maps import", &["pogema maps import four-rooms.map --out imported.yaml"]),
    ("maps tiles", &["pogema maps tiles four-rooms --side 13 --out tiles.yaml"]),
    ("maps editor", &["pogema maps editor --out editor.html"]),
    (
        "maps stats",
        &["pogema maps stats 'puzzle-.*'", "pogema maps stats four-rooms --num-agents 8 --seed 1 --json"],
    ),
    (
        "evaluate",
        &[
            "pogema evaluate suite.yaml --out results --html",
            "pogema evaluate suite.yaml --out results --resume",
        ],
    ),
    ("views", &["pogema views results", "pogema views results --format latex --plots pdf --out figures"]),
    ("replay", &["pogema replay results LaCAM 3 --html episode.html"]),
    (
        "render",
        &[
            "pogema render episode.jsonl.zst",
            "pogema render episode.jsonl.zst --svg episode.svg --gif episode.gif",
            "pogema render episode.jsonl.zst --png view.png --egocentric 2 --frame 5",
        ],
    ),
    (
        "conform",
        &[
            "pogema conform --cases 1000",
            "pogema conform --port 'python3 adapter.py' --html report.html",
            "pogema conform --port 'python3 adapter.py' --rules 'collide/*' --cases 50",
        ],
    ),
    ("port", &["pogema conform --port 'pogema port --engine fast' --part cases"]),
    ("bench", &["pogema bench --rows '64 agents, 32 x 32' --seconds 0.1"]),
];

/// The whole command line, with examples.
pub fn command() -> Command {
    EXAMPLES.iter().fold(Arguments::command(), |command, (path, examples)| {
        let path: Vec<&str> = path.split(' ').collect();
        let text = examples.join("\n  ");
        with_examples(command, &path, &format!("Examples:\n  {text}"))
    })
}

fn with_examples(command: Command, path: &[&str], text: &str) -> Command {
    match path.split_first() {
        None => command.after_help(text.to_owned()),
        Some((name, rest)) => command.mut_subcommand(name, |command| with_examples(command, rest, text)),
    }
}

/// Reads the arguments of the program; returns `None` if there are none.
///
/// # Errors
/// Usage errors; also the help text and the version, which clap returns as errors.
pub fn parse() -> Result<Option<Arguments>, clap::Error> {
    if std::env::args_os().len() == 1 {
        return Ok(None);
    }
    let mut command = command();
    let matches = command.try_get_matches_from_mut(std::env::args_os())?;
    Arguments::from_arg_matches(&matches).map(Some).map_err(|error| error.format(&mut command))
}

/// Prints the first steps for a new user.
pub fn print_first_steps() -> Result<(), Error> {
    print_bytes(FIRST_STEPS.as_bytes())
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;
    use std::path::Path;
    use std::{env, fs};

    use clap::Arg;
    use clap::error::{ContextKind, ContextValue, ErrorKind};

    use super::*;

    /// All commands without subcommands, each with its path, for example `maps list`.
    fn leaves(command: &Command, path: &str) -> Vec<(String, Command)> {
        let subcommands: Vec<&Command> =
            command.get_subcommands().filter(|command| command.get_name() != "help").collect();
        if subcommands.is_empty() {
            return vec![(path.to_owned(), command.clone())];
        }
        let path_of = |name: &str| format!("{path} {name}").trim().to_owned();
        subcommands.iter().flat_map(|command| leaves(command, &path_of(command.get_name()))).collect()
    }

    #[test]
    fn each_command_has_examples() {
        for (path, command) in leaves(&command(), "") {
            let text = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            assert!(text.starts_with("Examples:\n"), "{path}");
        }
    }

    #[test]
    fn examples_are_accepted() {
        let shown = FIRST_STEPS.lines().filter_map(|line| line.strip_prefix("  "));
        for example in EXAMPLES.iter().flat_map(|(_, examples)| examples.iter().copied()).chain(shown) {
            let words = shell_words::split(example).unwrap();
            command().try_get_matches_from(&words).unwrap_or_else(|error| panic!("{example}: {error}"));
        }
    }

    /// Returns an option with a value that it accepts.
    fn with_value(command: &Command, option: &Arg) -> Vec<String> {
        let flag = format!("--{}", option.get_long().unwrap());
        let possible = option.get_possible_values();
        let samples = possible
            .first()
            .map(clap::builder::PossibleValue::get_name)
            .into_iter()
            .chain(["1", "0.5", "0..2", "#112233", "x", "move/*"]);
        let accepted = samples.map(|value| vec![flag.clone(), value.to_owned()]).find(|words| {
            !matches!(
                failure(command, words),
                Some((ErrorKind::ValueValidation | ErrorKind::InvalidValue, _))
            )
        });
        if option.get_action().takes_values() {
            accepted.unwrap_or_else(|| panic!("no sample for {flag}"))
        } else {
            vec![flag]
        }
    }

    /// Returns the kind of the error that the arguments cause, and the required arguments that are missing; `None` if
    /// the arguments are accepted.
    fn failure(command: &Command, words: &[String]) -> Option<(ErrorKind, Vec<String>)> {
        let words = [&["pogema".to_owned()], words].concat();
        let error = command.clone().try_get_matches_from(words).err()?;
        let missing = match error.get(ContextKind::InvalidArg) {
            Some(ContextValue::Strings(names)) if error.kind() == ErrorKind::MissingRequiredArgument => {
                names.clone()
            }
            _ => Vec::new(),
        };
        Some((error.kind(), missing))
    }

    /// If a given argument conflicts with a required one, clap does not report that the required one is missing. The
    /// option that requires it would then be ignored, so clap must reject that option together with the given argument.
    #[test]
    fn options_are_rejected_together_with_options_that_exclude_their_requirement() {
        let mut num_pairs = 0;
        for (path, command) in leaves(&command(), "") {
            let missing =
                |words: &[String]| failure(&command, words).map(|(_, missing)| missing).unwrap_or_default();
            let always = missing(&[]);
            let options: Vec<&Arg> = command.get_opts().filter(|option| option.get_id() != "help").collect();
            for option in &options {
                let words = with_value(&command, option);
                let required: Vec<String> =
                    missing(&words).into_iter().filter(|name| !always.contains(name)).collect();
                let [required] = &*required else { continue };
                for other in &options {
                    let others = with_value(&command, other);
                    let is_required = required.starts_with(&others[0]);
                    let both = failure(&command, &[&*words, &others].concat());
                    let is_rejected = both.is_some_and(|(kind, missing)| {
                        kind == ErrorKind::ArgumentConflict || missing.contains(required)
                    });
                    assert!(is_required || option == other || is_rejected, "{path} {words:?} {others:?}");
                    num_pairs += 1;
                }
            }
        }
        assert!(num_pairs > 200, "{num_pairs}");
    }

    #[test]
    fn options_without_effect_are_rejected() {
        let rejected = [
            "--oracle --port x",
            "--oracle --trace x",
            "--oracle --junit x",
            "--oracle --input-limit 1",
            "--trace x --port x",
            "--trace x --rules move/*",
            "--trace x --html x",
            "--trace x --cases 1",
            "--trace x --seed 1",
            "--trace x --keep x",
            "--port x --input-limit 1",
            "--vectors x --cases 1",
            "--vectors x --port x",
        ];
        let (_, conform) = leaves(&command(), "").into_iter().find(|(path, _)| path == "conform").unwrap();
        for options in rejected {
            let words: Vec<String> = options.split(' ').map(ToOwned::to_owned).collect();
            let kind = failure(&conform, &words).map(|(kind, _)| kind);
            assert_eq!(kind, Some(ErrorKind::ArgumentConflict), "{options}");
        }
    }

    /// With the environment variable `BLESS` set, this test writes the page instead of comparing.
    #[test]
    fn the_page_of_commands_is_up_to_date() {
        let mut page = String::from(
            "# Commands\n\nThis page is generated from the program's help: `BLESS=1 cargo test -p pogema-cli` writes it.\n",
        );
        for (path, mut command) in leaves(&command(), "") {
            command = command.bin_name(format!("pogema {path}")).term_width(100);
            let help = command.render_long_help().to_string();
            let help: String = help.lines().fold(String::new(), |text, line| text + line.trim_end() + "\n");
            write!(page, "\n## pogema {path}\n\n```text\n{}\n```\n", help.trim_end()).unwrap();
        }
        page += "\n**What next:** [Run an episode](../guide/run.md), [Configuration fields](config.md).\n";
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/reference/cli.md");
        if env::var_os("BLESS").is_some() {
            fs::write(&path, &page).unwrap();
        }
        assert!(
            fs::read_to_string(&path).unwrap() == page,
            "docs/reference/cli.md is out of date: set BLESS=1"
        );
    }
}
