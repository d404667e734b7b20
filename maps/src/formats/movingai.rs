//! Maps of the MovingAI benchmarks.

use pogema_core::{Error, Map, counted, words};

use crate::text::{column_of, parse_side};

words! {
    /// Whether agents may enter water, which MovingAI writes as `W`.
    #[derive(Default)]
    pub enum Water {
        /// Water is free, as in pogema-toolbox and the published map sets.
        #[default]
        Free = "free",
        /// Water is an obstacle, as MovingAI defines it for walking agents.
        Obstacle = "obstacle",
    }
}

/// Reads a `.map` file.
///
/// Ground (`.`, `G`) and swamp (`S`) are free; trees (`T`) and out-of-bounds cells (`@`, `O`) are obstacles. `water`
/// determines whether water (`W`) is free.
///
/// # Errors
/// [`Error::Map`] with line and column for an invalid header, a number or length of rows that contradicts it, or a
/// letter that is not listed above.
///
/// Source: MovingAI, "Benchmark problem sets for grid-based pathfinding", file formats; pogema-toolbox 0.1.1,
/// `moving_ai_ingestion.py`, `map_to_grid`
pub fn read_movingai(text: &str, water: Water) -> Result<Map, Error> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines = (1..).zip(text.lines());
    let (height, width) = read_header(&mut lines)?;
    let mut obstacles = Vec::new();
    let mut last_line = HEADER_LINES;
    for row in 0..height {
        let Some((line, letters)) = lines.next() else {
            let reason =
                format!("row {} is missing, expected {} as in the header", row + 1, counted(height, "row"));
            return Err(Error::Map { line: last_line + 1, column: 1, reason });
        };
        last_line = line;
        read_row(line, letters.trim_end(), width, water, &mut obstacles)?;
    }
    if let Some((line, _)) = lines.find(|(_, text)| !text.trim().is_empty()) {
        let reason = format!("found another row, expected {} as in the header", counted(height, "row"));
        return Err(Error::Map { line, column: 1, reason });
    }
    Map::new(height, width, obstacles)
}

const HEADER_LINES: usize = 4;

fn read_header<'a>(lines: &mut impl Iterator<Item = (usize, &'a str)>) -> Result<(usize, usize), Error> {
    let mut sides = [None; 2];
    let mut has_type = false;
    for number in 1..=HEADER_LINES {
        let (line, text) = lines.next().unwrap_or((number, ""));
        let wrong = |part: &str, expected: &str| {
            let found = pogema_core::shorten(part, Error::LONGEST_QUOTE);
            let reason = format!("found `{found}`, expected {expected}");
            Error::Map { line, column: column_of(text, part), reason }
        };
        let read_side = |side: &str| parse_side(side, |expected| wrong(side, expected));
        let mut words = text.split_whitespace();
        match (words.next(), words.next(), words.next()) {
            (Some("type"), Some(_), None) if !has_type => has_type = true,
            (Some("height"), Some(side), None) if sides[0].is_none() => {
                sides[0] = Some(read_side(side)?);
            }
            (Some("width"), Some(side), None) if sides[1].is_none() => {
                sides[1] = Some(read_side(side)?);
            }
            (Some("map"), None, None) if number == HEADER_LINES => {}
            _ if number == HEADER_LINES => return Err(wrong(text, "`map`")),
            _ => {
                return Err(wrong(
                    text,
                    "`type octile`, `height N` and `width N`, each on a line of its own",
                ));
            }
        }
    }
    match sides {
        [Some(height), Some(width)] => Ok((height, width)),
        _ => Err(Error::Map { line: 1, column: 1, reason: "the header has no height or no width".into() }),
    }
}

fn read_row(
    line: usize,
    letters: &str,
    width: usize,
    water: Water,
    obstacles: &mut Vec<bool>,
) -> Result<(), Error> {
    let mut length = 0;
    for (col, letter) in letters.chars().enumerate() {
        let column = col + 1;
        if col == width {
            let reason = format!("the row is longer than the {} of the header", counted(width, "cell"));
            return Err(Error::Map { line, column, reason });
        }
        obstacles.push(match letter {
            '.' | 'G' | 'S' => false,
            '@' | 'O' | 'T' => true,
            'W' => water == Water::Obstacle,
            other => {
                let reason = format!("unknown terrain `{other}`, expected one of `.GS@OTW`");
                return Err(Error::Map { line, column, reason });
            }
        });
        length += 1;
    }
    if length < width {
        let reason = format!("the row has {}, expected {width} as in the header", counted(length, "cell"));
        return Err(Error::Map { line, column: length + 1, reason });
    }
    Ok(())
}

/// Writes a `.map` file, with `.` for free cells and `@` for obstacles.
pub fn write_movingai(map: &Map) -> String {
    let mut text = format!("type octile\nheight {}\nwidth {}\nmap\n", map.height(), map.width());
    for row in map.rows() {
        text += &row.replace('#', "@");
        text.push('\n');
    }
    text
}

/// Returns the map without its outermost rows and columns, as pogema-toolbox removes them.
///
/// # Errors
/// [`Error::Instance`] for a map of fewer than three rows or columns, which would leave no cell.
///
/// Source: pogema-toolbox 0.1.1, `moving_ai_ingestion.py`, `map_to_grid`
pub fn without_outermost_cells(map: &Map) -> Result<Map, Error> {
    let (height, width) = map.sides();
    if height < 3 || width < 3 {
        let reason = format!(
            "the map has {height} x {width} cells, expected at least 3 x 3 to remove the outermost rows and columns"
        );
        return Err(Error::instance(reason));
    }
    let rows = map.obstacles().chunks(width).skip(1).take(height - 2);
    let inner = rows.flat_map(|row| row[1..width - 1].iter().copied()).collect();
    Map::new(height - 2, width - 2, inner)
}
