//! Files of traces: JSON Lines. They end with the number of steps and a hash, so that a truncated file is not mistaken
//! for a complete one.

use std::io::{BufRead, Write};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::{FORMAT, SPEC, Trace, TraceHeader, TraceStart, TraceStep};
use crate::{Error, Snapshot, shorten};

/// The format of the files that this version writes.
const FILE_FORMAT: &str = "pogema-trace/2";

/// The versions, which are on the first line in every version of the format.
#[derive(Deserialize)]
struct Versions {
    format: String,
    spec: String,
}

impl Versions {
    /// Checks the versions, and returns whether the file must end with a [`TraceEnd`].
    fn check(&self) -> Result<bool, Error> {
        let known = [("format", &self.format, &[FILE_FORMAT, FORMAT][..]), ("spec", &self.spec, &[SPEC])];
        for (what, got, expected) in known {
            if !expected.contains(&got.as_str()) {
                let expected = expected.join("` or `");
                let reason =
                    format!("the {what} is `{}`, expected `{expected}`", shorten(got, Error::LONGEST_QUOTE));
                return Err(Error::Trace { line: 1, reason });
            }
        }
        Ok(self.format == FILE_FORMAT)
    }
}

/// The last line of a file.
#[derive(Serialize, Deserialize)]
struct TraceEnd {
    num_steps: usize,
    /// The hash of all previous lines, each with a line feed, in hexadecimal digits.
    sha256: String,
}

impl TraceEnd {
    fn new(num_steps: usize, lines: Sha256) -> Self {
        let hash = lines.finalize();
        let sha256 = hash.iter().fold(String::new(), |digits, byte| digits + &format!("{byte:02x}"));
        Self { num_steps, sha256 }
    }

    /// Checks the last line of a file against the lines before it.
    fn check(&self, line: usize, expected: &Self) -> Result<(), Error> {
        let (stated, counted) = (self.num_steps, expected.num_steps);
        let reason = if stated != counted {
            format!("`num_steps` is `{stated}`, expected {counted}, the number of steps before it")
        } else if self.sha256 != expected.sha256 {
            let stated = shorten(&self.sha256, Error::LONGEST_QUOTE);
            format!("`sha256` is `{stated}`, expected `{}`, the hash of the lines before it", expected.sha256)
        } else {
            return Ok(());
        };
        Err(Error::Trace { line, reason })
    }
}

impl Trace {
    /// Reads a trace from JSON Lines.
    ///
    /// # Errors
    /// [`Error::Trace`] with the number of the wrong line, or of the first missing line.
    pub fn read(input: impl BufRead) -> Result<Self, Error> {
        let mut lines = Lines { input: input.lines(), line: 0, hash: Sha256::new() };
        let text = lines.expect("the header")?;
        let has_end = parse::<Versions>(1, &text)?.check()?;
        let header: TraceHeader = parse(1, &text)?;
        header.check().map_err(|error| Error::Trace { line: 1, reason: error.to_string() })?;
        let header = TraceHeader { format: FORMAT.into(), ..header };
        let num_agents = header.config.num_agents;
        lines.keep(&text);
        let text = lines.expect("the start")?;
        let start: TraceStart = parse(2, &text)?;
        check_state(2, num_agents, &start.state)?;
        lines.keep(&text);
        let mut steps: Vec<TraceStep> = Vec::new();
        let mut end = None;
        while let Some(text) = lines.next_filled()? {
            let line = lines.line;
            if end.is_some() {
                return Err(Error::Trace {
                    line,
                    reason: "an extra line after `num_steps` and `sha256`, expected the end of the file"
                        .into(),
                });
            }
            if has_end && text.contains("\"sha256\"") {
                let found: TraceEnd = parse(line, &text)?;
                found.check(line, &TraceEnd::new(steps.len(), lines.hash.clone()))?;
                end = Some(found);
            } else {
                let step: TraceStep = parse(line, &text)?;
                step.check(line, num_agents)?;
                lines.keep(&text);
                steps.push(step);
            }
        }
        if has_end && end.is_none() {
            return Err(lines.ends_before("its last line, `num_steps` and `sha256`"));
        }
        Ok(Self { header, start, steps })
    }

    /// Writes the trace as JSON Lines.
    ///
    /// # Errors
    /// [`Error::Io`] if the writer fails.
    pub fn write(&self, mut output: impl Write) -> Result<(), Error> {
        let mut hash = Sha256::new();
        let mut put = |text: serde_json::Result<String>| {
            let text = text.map_err(|error| Error::io("trace", error))? + "\n";
            hash.update(&text);
            output.write_all(text.as_bytes()).map_err(|error| Error::io("trace", error))
        };
        put(serde_json::to_string(&TraceHeader { format: FILE_FORMAT.into(), ..self.header.clone() }))?;
        put(serde_json::to_string(&self.start))?;
        self.steps.iter().try_for_each(|step| put(serde_json::to_string(step)))?;
        let end = serde_json::to_string(&TraceEnd::new(self.steps.len(), hash));
        let end = end.map_err(|error| Error::io("trace", error))?;
        writeln!(output, "{end}").map_err(|error| Error::io("trace", error))
    }
}

/// The lines of a file.
struct Lines<R> {
    input: std::io::Lines<R>,
    /// The number of lines so far.
    line: usize,
    /// The hash of all lines that are part of the trace.
    hash: Sha256,
}

impl<R: BufRead> Lines<R> {
    fn next(&mut self) -> Result<Option<String>, Error> {
        self.line += 1;
        let failed = |error: std::io::Error| Error::Trace { line: self.line, reason: error.to_string() };
        self.input.next().transpose().map_err(failed)
    }

    /// Returns the next line that is not blank.
    fn next_filled(&mut self) -> Result<Option<String>, Error> {
        loop {
            match self.next()? {
                Some(text) if text.trim().is_empty() => {}
                line => return Ok(line),
            }
        }
    }

    fn expect(&mut self, what: &str) -> Result<String, Error> {
        self.next()?.ok_or_else(|| self.ends_before(what))
    }

    fn ends_before(&self, what: &str) -> Error {
        Error::Trace { line: self.line, reason: format!("the trace ends before {what}") }
    }

    /// Adds a line of the trace and a line feed to the hash, even if the file ends its lines with CR LF.
    fn keep(&mut self, text: &str) {
        self.hash.update(text);
        self.hash.update("\n");
    }
}

impl TraceStep {
    fn check(&self, line: usize, num_agents: usize) -> Result<(), Error> {
        check_state(line, num_agents, &self.state)?;
        check_list(line, num_agents, "actions", &self.actions)?;
        check_list(line, num_agents, "rewards", &self.rewards)?;
        check_list(line, num_agents, "terminated", &self.terminated)?;
        check_list(line, num_agents, "truncated", &self.truncated)
    }
}

fn check_state(line: usize, num_agents: usize, state: &Snapshot) -> Result<(), Error> {
    check_list(line, num_agents, "cells", &state.cells)?;
    check_list(line, num_agents, "goals", &state.goals)?;
    check_list(line, num_agents, "active", &state.active)?;
    check_list(line, num_agents, "on_goal", &state.on_goal)
}

fn check_list<T>(line: usize, num_agents: usize, name: &str, list: &[T]) -> Result<(), Error> {
    if list.len() == num_agents {
        return Ok(());
    }
    let reason = format!("`{name}` has length {}, expected {num_agents}, one for each agent", list.len());
    Err(Error::Trace { line, reason })
}

/// Longest part of a parser message that is quoted, since parsers quote unknown words in full. Units: characters.
const LONGEST_REASON: usize = 240;

fn parse<T: serde::de::DeserializeOwned>(line: usize, text: &str) -> Result<T, Error> {
    serde_json::from_str(text).map_err(|error| {
        // The parser gets one line at a time, so it reports every line as the first.
        let (column, message) = (error.column(), error.to_string());
        let bare = message.strip_suffix(&format!(" at line 1 column {column}")).unwrap_or(&message);
        let reason = match bare.rsplit_once(", expected ") {
            Some((found, expected)) => format!("{found}, expected {}", in_words(expected)),
            None => bare.to_owned(),
        };
        Error::Trace { line, reason: format!("column {column}: {}", shorten(&reason, LONGEST_REASON)) }
    })
}

/// Names a Rust type for readers who write traces in another language.
fn in_words(expected: &str) -> &str {
    match expected {
        "u16" | "i32" | "i64" | "u64" | "usize" => "a whole number",
        "f32" | "f64" => "a number",
        "variant identifier" => "a string",
        "a sequence" => "a list",
        _ if expected.starts_with("struct ") || expected.contains("enum ") => "an object",
        _ => expected,
    }
}
