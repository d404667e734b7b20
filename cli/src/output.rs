//! Standard output and output files of the program.

use std::io::{ErrorKind, Write};
use std::path::Path;

use comfy_table::{CellAlignment, Table, TableStyle, presets};
use indicatif::{ProgressBar, ProgressStyle};
use pogema_core::{Error, Trace};
use pogema_toolbox::short;
use serde::Serialize;

/// Prints a line; exits with status 0 if the reader has closed the pipe, as in `pogema conform | head`.
pub fn print_line(text: &str) -> Result<(), Error> {
    let mut output = std::io::stdout().lock();
    check_printed(writeln!(output, "{text}").and_then(|()| output.flush()))
}

/// Checks the outcome of a write to standard output; exits with status 0 if the reader has closed the pipe.
pub fn check_printed(outcome: std::io::Result<()>) -> Result<(), Error> {
    match outcome {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => std::process::exit(0),
        outcome => outcome.map_err(|error| Error::io("standard output", error)),
    }
}

/// Checks that a file can be written at `path`, so that a long run fails at its start and not at its end.
///
/// # Errors
/// [`Error::Io`] if no file can be created in the folder, or if `path` exists and is not a regular file.
pub fn check_writable(path: &Path) -> Result<(), Error> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match std::fs::metadata(folder) {
        Ok(there) if !there.is_dir() => {
            return Err(Error::io(path, format!("`{}` is not a folder", folder.display())));
        }
        Ok(_) => {}
        Err(error) => return Err(Error::io(path, format!("`{}`: {error}", folder.display()))),
    }
    // Writing replaces the file at `path`, which would destroy a device or a pipe.
    let is_taken = std::fs::metadata(path).is_ok_and(|there| !there.is_file());
    if is_taken || path.file_name().is_none() {
        return Err(Error::io(path, "is not a regular file"));
    }
    // The test file has no name, so that nothing remains of it, even if the process is killed.
    tempfile::tempfile_in(folder).map(|_| ()).map_err(|error| Error::io(path, error))
}

/// Writes a value as JSON.
///
/// # Errors
/// [`Error::Io`] if it cannot be written.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<(), Error> {
    let text = serde_json::to_vec_pretty(value).map_err(|error| Error::io(path, error))?;
    pogema_conformance::files::write(path, &text)
}

/// Writes the trace of an episode, compressed if the file's name ends in `.zst`.
///
/// # Errors
/// [`Error::Io`] if it cannot be written.
pub fn write_trace(path: &Path, trace: &Trace) -> Result<(), Error> {
    let mut text = Vec::new();
    trace.write(&mut text)?;
    pogema_conformance::files::write(path, &text)
}

/// Returns a progress bar with an indicatif template.
pub fn progress_bar(layout: &str, total: u64) -> ProgressBar {
    let bar = ProgressBar::new(total);
    if let Ok(style) = ProgressStyle::with_template(layout) {
        bar.set_style(style);
    }
    bar
}

/// Formats metrics in one line.
pub fn in_one_line<'a>(metrics: impl IntoIterator<Item = (&'a str, f64)>) -> String {
    let shown = metrics.into_iter().map(|(name, value)| format!("{name}={}", short(value)));
    shown.collect::<Vec<_>>().join("  ")
}

/// Returns a function that names `flag` in errors about a value out of range.
pub fn flagged(flag: &'static str) -> impl Fn(Error) -> Error {
    move |error| match error {
        Error::OutOfRange { value, expected, .. } => Error::argument(flag, value, expected),
        error => error,
    }
}

/// Returns a Markdown table: a column of names, then right-aligned numbers; ` | ` separates the titles in `head`.
pub fn markdown_table(head: &str) -> Table {
    table(presets::ASCII_MARKDOWN, &head.split(" | ").collect::<Vec<_>>())
}

/// Returns a table with lines between its columns: a column of names, then right-aligned numbers.
pub fn lined_table(head: &[&str]) -> Table {
    table(presets::UTF8_FULL_CONDENSED, head)
}

fn table(style: TableStyle, head: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_style(style).set_header(head.to_vec());
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}
