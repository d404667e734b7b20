//! Standard output and output files of the program.

use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use comfy_table::{CellAlignment, Table, TableStyle, presets};
use indicatif::{ProgressBar, ProgressStyle};
use pogema_core::files::{folder_of, place_of};
use pogema_core::{Error, Trace, one_line, printable_json};
use pogema_toolbox::{fitted, short};
use serde::Serialize;
use serde_json::Value;

/// Whether the reader of standard output has closed the pipe, as in `pogema conform | head`. The rest of the output is
/// lost then, and the command continues, because it may have files to write and an exit status to return.
static IS_CLOSED: AtomicBool = AtomicBool::new(false);

/// Returns whether printed text is lost, so that a command that only prints may end early.
pub fn is_closed() -> bool {
    IS_CLOSED.load(Relaxed)
}

/// Prints text to standard output, with its unprintable characters escaped, and a line feed.
pub fn print_line(text: &str) -> Result<(), Error> {
    print_bytes(format!("{}\n", escaped(text)).as_bytes())
}

/// Prints a value as JSON on one line. Unprintable characters in strings become JSON escapes; the value is unchanged.
pub fn print_json(value: &Value) -> Result<(), Error> {
    print_bytes(format!("{}\n", printable_json(&value.to_string())).as_bytes())
}

/// Prints bytes to standard output as they are.
pub fn print_bytes(bytes: &[u8]) -> Result<(), Error> {
    if is_closed() {
        return Ok(());
    }
    let mut output = std::io::stdout().lock();
    check_printed(output.write_all(bytes).and_then(|()| output.flush()))
}

/// Checks the outcome of a write to standard output. A closed pipe is not an error, see [`is_closed`].
pub fn check_printed(outcome: std::io::Result<()>) -> Result<(), Error> {
    match outcome {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => {
            IS_CLOSED.store(true, Relaxed);
            Ok(())
        }
        outcome => outcome.map_err(|error| Error::io("standard output", error)),
    }
}

/// Prints a line to standard error. If that is closed or full, the line is lost and the program continues.
pub fn tell(line: &str) {
    tell_lines(&one_line(line));
}

/// Prints warnings to standard error, see [`tell`].
pub fn tell_warnings(warnings: &[String]) {
    for warning in warnings {
        tell(&format!("warning: {warning}"));
    }
}

/// Prints lines to standard error, see [`tell`].
pub fn tell_lines(text: &str) {
    let _ = std::io::stderr().lock().write_all(format!("{}\n", escaped(text)).as_bytes());
}

/// Escapes all unprintable characters but line feeds.
fn escaped(text: &str) -> String {
    text.split('\n').map(one_line).collect::<Vec<_>>().join("\n")
}

/// Checks that a file can be written at `path`, so that a long run fails at its start and not at its end.
///
/// # Errors
/// [`Error::Io`] if no file can be created in the folder, or if `path` exists and is not a regular file.
pub fn check_writable(path: &Path) -> Result<(), Error> {
    let place = place_of(path)?;
    let folder = folder_of(&place);
    match std::fs::metadata(folder) {
        Ok(there) if !there.is_dir() => {
            return Err(Error::io(path, format!("`{}` is not a folder", folder.display())));
        }
        Ok(_) => {}
        Err(error) => return Err(Error::io(path, format!("`{}`: {error}", folder.display()))),
    }
    // The test file has no name, so that nothing remains of it, even if the process is killed.
    tempfile::tempfile_in(folder).map(|_| ()).map_err(|error| Error::io(path, error))
}

/// Checks that files can be written to a folder, which may not exist yet. Leaves nothing behind.
///
/// # Errors
/// [`Error::Io`] if a part of the path is not a folder, or if nothing can be created in the last existing part.
pub fn check_folder(folder: &Path) -> Result<(), Error> {
    let mut parts =
        folder.ancestors().map(|part| if part.as_os_str().is_empty() { Path::new(".") } else { part });
    let existing = parts.find(|part| part.exists()).unwrap_or(Path::new("."));
    if !existing.is_dir() {
        return Err(Error::io(folder, format!("`{}` is not a folder", existing.display())));
    }
    tempfile::tempfile_in(existing).map(|_| ()).map_err(|error| Error::io(folder, error))
}

/// Checks that the files that flags name can be written, that no two flags name the same file, and that none of the
/// files is among those that the command reads.
///
/// # Errors
/// [`Error::Request`] if two flags name the same file, or if a flag names a file that the command reads; those of
/// [`check_writable`].
pub fn check_files<'a>(
    inputs: &[&Path],
    files: impl IntoIterator<Item = (&'a str, &'a Path)>,
) -> Result<(), Error> {
    let inputs: Vec<PathBuf> = inputs.iter().filter_map(|path| identity_of(path)).collect();
    let mut taken: Vec<(&str, PathBuf)> = Vec::new();
    for (flag, path) in files {
        check_writable(path)?;
        let Some(place) = identity_of(path) else { continue };
        if inputs.contains(&place) {
            let reason = format!("`{flag}` would overwrite `{}`, which the command reads", path.display());
            return Err(Error::request(reason));
        }
        if let Some((other, _)) = taken.iter().find(|(_, known)| *known == place) {
            let reason = format!("`{other}` and `{flag}` name the same file, `{}`", path.display());
            return Err(Error::request(reason));
        }
        taken.push((flag, place));
    }
    Ok(())
}

/// Returns whether two paths name one folder, which may be missing.
pub fn is_same_folder(one: &Path, other: &Path) -> bool {
    let place = |path: &Path| path.canonicalize().or_else(|_| std::path::absolute(path)).ok();
    place(one) == place(other)
}

/// Returns a path that is equal for all paths to a file, such as `x`, `./x`, `folder/../x` and links to it; `None` if
/// its folder does not exist, or for anything but a regular file.
fn identity_of(path: &Path) -> Option<PathBuf> {
    let place = place_of(path).ok()?;
    let folder = folder_of(&place).canonicalize().ok()?;
    Some(without_case(folder.join(place.file_name()?)))
}

/// Converts a path to lower case on operating systems where most file systems ignore case.
fn without_case(path: PathBuf) -> PathBuf {
    if cfg!(any(windows, target_os = "macos")) { path.to_string_lossy().to_lowercase().into() } else { path }
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
    pogema_conformance::files::write_with(path, |file| trace.write(file))
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

/// Prints a table, at most as wide as the terminal.
pub fn print_table(table: Table) -> Result<(), Error> {
    print_line(&fitted(table))
}

/// Returns a function that names `flag` in errors about a value out of range.
pub fn flagged(flag: &'static str) -> impl Fn(Error) -> Error {
    move |error| match error {
        Error::OutOfRange { value, expected, .. } => Error::argument(flag, value, expected),
        error => error,
    }
}

/// Names the flag in an error about an argument that only a flag of the same name can set.
pub fn with_flag(error: Error) -> Error {
    match error {
        Error::Argument { name, value, expected } if !name.starts_with('-') => {
            Error::argument(&format!("--{}", name.replace('_', "-")), value, expected)
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_paths_to_a_file_count_as_the_same_file() {
        let folder = tempfile::tempdir().unwrap();
        let [file, inner] = ["a", "inner"].map(|name| folder.path().join(name));
        std::fs::create_dir(&inner).unwrap();
        std::fs::write(&file, "").unwrap();
        let error = |inputs: &[&Path], one: &Path, other: &Path| {
            check_files(inputs, [("--one", one), ("--other", other)]).unwrap_err().to_string()
        };
        let again = inner.join("../a");
        assert!(error(&[], &file, &again).starts_with("`--one` and `--other` name the same file"));
        assert!(error(&[&again], &inner.join("b"), &file).starts_with("`--other` would overwrite"));
        #[cfg(unix)]
        {
            let link = folder.path().join("link");
            std::os::unix::fs::symlink(".", &link).unwrap();
            assert!(error(&[], &file, &link.join("a")).contains("name the same file"));
            let name = folder.path().join("name");
            std::os::unix::fs::symlink("a", &name).unwrap();
            assert!(error(&[&name], &inner.join("b"), &file).contains("would overwrite"));
        }
    }
}
