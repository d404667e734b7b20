//! What the program says on standard output and writes to files.

use std::io::{ErrorKind, Write};
use std::path::Path;

use comfy_table::{CellAlignment, Table, TableStyle, presets};
use indicatif::{ProgressBar, ProgressStyle};
use pogema_core::{Error, Trace};
use pogema_toolbox::short;
use serde::Serialize;

/// Writes a line; ends the program quietly if nobody reads any more, as in `pogema conform | head`.
pub fn say(text: &str) -> Result<(), Error> {
    let mut output = std::io::stdout().lock();
    said(writeln!(output, "{text}").and_then(|()| output.flush()))
}

/// The outcome of writing to standard output; ends the program quietly if nobody reads any more.
pub fn said(outcome: std::io::Result<()>) -> Result<(), Error> {
    match outcome {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => std::process::exit(0),
        outcome => outcome.map_err(|error| Error::io("standard output", error)),
    }
}

/// Passes if a file can be written here, so that a long run does not find out at its end that it was for nothing.
///
/// # Errors
/// [`Error::Io`] if the folder takes no file, or something other than a file is in the way.
pub fn check_writable(path: &Path) -> Result<(), Error> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match std::fs::metadata(folder) {
        Ok(there) if !there.is_dir() => {
            return Err(Error::io(path, format!("`{}` is no folder", folder.display())));
        }
        Ok(_) => {}
        Err(error) => return Err(Error::io(path, format!("`{}`: {error}", folder.display()))),
    }
    // What is written takes the place of what was there, which would be the end of a device or a pipe.
    let is_taken = std::fs::metadata(path).is_ok_and(|there| !there.is_file());
    if is_taken || path.file_name().is_none() {
        return Err(Error::io(path, "is no file"));
    }
    // A file without a name: nothing is left of it, however the run ends.
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

/// Writes what happened in an episode, compressed if the file's name ends in `.zst`.
///
/// # Errors
/// [`Error::Io`] if it cannot be written.
pub fn write_trace(path: &Path, trace: &Trace) -> Result<(), Error> {
    let mut text = Vec::new();
    trace.write(&mut text)?;
    pogema_conformance::files::write(path, &text)
}

/// A progress bar in a layout of indicatif.
pub fn progress_bar(layout: &str, total: u64) -> ProgressBar {
    let bar = ProgressBar::new(total);
    if let Ok(style) = ProgressStyle::with_template(layout) {
        bar.set_style(style);
    }
    bar
}

/// Metrics in one line.
pub fn in_a_line<'a>(metrics: impl IntoIterator<Item = (&'a str, f64)>) -> String {
    let shown = metrics.into_iter().map(|(name, value)| format!("{name}={}", short(value)));
    shown.collect::<Vec<_>>().join("  ")
}

/// Names the flag whose value an error is about.
pub fn flagged(flag: &'static str) -> impl Fn(Error) -> Error {
    move |error| match error {
        Error::OutOfRange { value, expected, .. } => Error::argument(flag, value, expected),
        error => error,
    }
}

/// A table that is Markdown too, its numbers to the right of a first column of names; ` | ` separates the titles.
pub fn markdown_table(head: &str) -> Table {
    table(presets::ASCII_MARKDOWN, &head.split(" | ").collect::<Vec<_>>())
}

/// A table with lines between its columns, its numbers to the right of a first column of names.
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
