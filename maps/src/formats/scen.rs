//! Scenarios of the MovingAI benchmarks: one start and one goal per line.

use std::fmt::Write;

use pogema_core::{Cell, Error, counted, shorten};

use crate::text::{column_of, parse_side};

/// One line of a `.scen` file.
#[derive(Clone, Debug, PartialEq)]
pub struct Task {
    /// MovingAI's class of path lengths: from 4 · bucket to 4 · bucket + 4.
    pub bucket: u64,
    /// Name of the map file.
    pub map: String,
    /// Number of rows of the map.
    pub height: usize,
    /// Number of columns of the map.
    pub width: usize,
    /// The agent's start.
    pub start: Cell,
    /// The agent's goal.
    pub goal: Cell,
    /// Length of a shortest path, diagonal steps included. Units: cells.
    pub length: f64,
}

/// Reads a `.scen` file. In this format, `x` is the column, `y` is the row, and `x` comes first.
///
/// # Errors
/// [`Error::Map`] with line and column for an invalid line, and for a start or goal off the map.
pub fn read_scen(text: &str) -> Result<Vec<Task>, Error> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines = (1..).zip(text.lines());
    let (_, first) = lines.next().unwrap_or((1, ""));
    let version = first.strip_prefix("version ").map(str::trim);
    if !matches!(version, Some("1" | "1.0")) {
        let found = shorten(first, Error::LONGEST_QUOTE);
        let reason = format!("found `{found}`, expected `version 1`");
        return Err(Error::Map { line: 1, column: 1, reason });
    }
    lines.filter(|(_, text)| !text.trim().is_empty()).map(|(line, text)| read_task(line, text)).collect()
}

const COLUMNS: [&str; 9] =
    ["bucket", "map", "map width", "map height", "start x", "start y", "goal x", "goal y", "optimal length"];

fn read_task(line: usize, text: &str) -> Result<Task, Error> {
    // Map names may contain spaces, so a line with tabs is split at tabs only.
    let fields: Vec<&str> = if text.contains('\t') {
        text.trim_end().split('\t').collect()
    } else {
        text.split_whitespace().collect()
    };
    let fields: [&str; 9] = fields.try_into().map_err(|fields: Vec<&str>| {
        let reason = format!(
            "the line has {}, expected {}: {}",
            counted(fields.len(), "column"),
            COLUMNS.len(),
            COLUMNS.join(", ")
        );
        Error::Map { line, column: 1, reason }
    })?;
    let wrong = |at: usize, expected: &str| {
        let found = shorten(fields[at], Error::LONGEST_QUOTE);
        let reason = format!("{} is `{found}`, expected {expected}", COLUMNS[at]);
        Error::Map { line, column: column_of(text, fields[at]), reason }
    };
    let side = |at: usize| parse_side(fields[at], |expected| wrong(at, expected));
    let (width, height) = (side(2)?, side(3)?);
    let coordinate = |at: usize, side: usize| {
        let number = fields[at].parse::<u16>().ok().filter(|&number| usize::from(number) < side);
        number.ok_or_else(|| wrong(at, &format!("a whole number from 0 to {}", side - 1)))
    };
    let length = fields[8].parse::<f64>().ok().filter(|length| length.is_finite() && *length >= 0.0);
    Ok(Task {
        bucket: fields[0].parse().map_err(|_| wrong(0, "a whole number"))?,
        map: fields[1].to_owned(),
        height,
        width,
        start: Cell::new(coordinate(5, height)?, coordinate(4, width)?),
        goal: Cell::new(coordinate(7, height)?, coordinate(6, width)?),
        length: length.ok_or_else(|| wrong(8, "a finite number of at least 0"))?,
    })
}

/// Writes a `.scen` file.
///
/// # Errors
/// [`Error::Instance`] for a map name that is empty, has surrounding white space, or holds a tab or a line break.
pub fn write_scen(tasks: &[Task]) -> Result<String, Error> {
    let mut text = String::from("version 1\n");
    for task in tasks {
        if task.map.is_empty() || task.map.contains(['\t', '\n', '\r']) || task.map.trim() != task.map {
            let name = shorten(&task.map, Error::LONGEST_QUOTE);
            return Err(Error::instance(format!(
                "`{name}` cannot be the name of a map in a .scen file, expected a name without tabs, line breaks or \
                 surrounding white space"
            )));
        }
        let Task { bucket, map, height, width, start, goal, length } = task;
        // INVARIANT: writing to a string never fails.
        let _ = writeln!(
            text,
            "{bucket}\t{map}\t{width}\t{height}\t{}\t{}\t{}\t{}\t{length}",
            start.col, start.row, goal.col, goal.row
        );
    }
    Ok(text)
}
