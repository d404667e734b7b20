//! `pogema maps list`, `show` and `editor`.

use std::path::PathBuf;

use clap::Args;
use comfy_table::CellAlignment;
use pogema_core::{Config, Error, GoalStream, Instance, Map, Outside, Trace, counted, one_line};
use pogema_maps::formats::NamedMap;
use pogema_maps::{GridConfig, MapStats, MapText, PUZZLES};
use pogema_render::{Style, html, raster, svg};

use super::{Sources, ambiguous_map, write_out};
use crate::output::{check_files, markdown_table, print_line, print_table};

#[derive(Args, Debug)]
pub struct List {
    /// Pattern that the names have to match, as pogema-toolbox matches `map_name` [default: all maps except the
    /// paper's generated sets]
    pattern: Option<String>,
    #[command(flatten)]
    sources: Sources,
}

impl List {
    pub fn run(&self) -> Result<(), Error> {
        let library = self.sources.library(self.pattern.as_deref())?;
        let names: Vec<&str> = match &self.pattern {
            Some(pattern) => library.matching(pattern)?,
            None => library.names().collect(),
        };
        let mut table = markdown_table("map | rows | columns | free | agents | least cost | task");
        for name in names {
            let text = library.map(name)?;
            let puzzle = PUZZLES.iter().find(|puzzle| puzzle.name == name);
            let agents = if text.starts.is_empty() { String::new() } else { text.starts.len().to_string() };
            table.add_row([
                one_line(name),
                text.map.height().to_string(),
                text.map.width().to_string(),
                text.map.num_free().to_string(),
                agents,
                puzzle.map_or_else(String::new, |puzzle| puzzle.sum_of_costs.to_string()),
                puzzle.map_or_else(String::new, |puzzle| puzzle.task.to_owned()),
            ]);
        }
        if let Some(task) = table.column_mut(6) {
            task.set_cell_alignment(CellAlignment::Left);
        }
        print_table(table)
    }
}

#[derive(Args, Debug)]
pub struct Show {
    /// Map to draw: a name, a pattern of names, a file or a folder
    map: String,
    #[command(flatten)]
    sources: Sources,
    /// Maximum width of the picture in characters; wider maps are scaled down [default: the width of the terminal]
    #[arg(long, value_name = "COLUMNS")]
    width: Option<usize>,
    /// Also write an SVG picture of the map to this file
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Also write a PNG picture of the map to this file
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
}

impl Show {
    pub fn run(&self) -> Result<(), Error> {
        let max_width = self.width.unwrap_or_else(|| usize::from(console::Term::stdout().size().1)).max(1);
        let files = [("--svg", &self.svg), ("--png", &self.png)];
        check_files(&[], files.into_iter().filter_map(|(flag, path)| Some((flag, path.as_deref()?))))?;
        let maps = self.sources.resolve(&self.map)?;
        self.draw(&maps)?;
        for NamedMap { name, text } in maps {
            let figures = MapStats::of(&text.map);
            print_line(&format!(
                "{}: {}, {}, {}, density {:.3}, {}",
                one_line(&name),
                counted(figures.height, "row"),
                counted(figures.width, "column"),
                counted(figures.num_free, "free cell"),
                figures.density,
                counted(figures.components.len(), "component"),
            ))?;
            print_line(&picture(&text, max_width))?;
        }
        Ok(())
    }

    fn draw(&self, maps: &[NamedMap]) -> Result<(), Error> {
        if self.svg.is_none() && self.png.is_none() {
            return Ok(());
        }
        let [NamedMap { text, .. }] = maps else {
            return Err(ambiguous_map(&self.map, maps.len(), "for a picture"));
        };
        let (trace, style) = (still(text)?, Style { static_frame: Some(0), ..Style::default() });
        if let Some(path) = &self.svg {
            write_out(Some(path), svg::draw(&trace, &style)?.as_bytes())?;
        }
        if let Some(path) = &self.png {
            let width = raster::width_for(&trace, &style, raster::LONGER_SIDE);
            write_out(Some(path), &raster::png(&trace, &style, width)?)?;
        }
        Ok(())
    }
}

/// Returns a trace without steps: the map and its agents.
fn still(text: &MapText) -> Result<Trace, Error> {
    let goals = text.goals.first().into_iter().map(GoalStream::single).collect();
    let instance = Instance::new(text.map.clone(), Outside::Free, text.starts.clone(), goals)?;
    let config = Config { num_agents: text.starts.len(), ..GridConfig::default().rules() };
    Ok(Trace::still(config, &instance))
}

#[derive(Args, Debug)]
pub struct Editor {
    /// HTML file to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

impl Editor {
    pub fn run(&self) -> Result<(), Error> {
        write_out(Some(&self.out), html::editor().as_bytes())
    }
}

/// Draws a map as text. If starts and goals share cells, draws two maps side by side. If the picture is too wide or
/// cannot be written as text, draws dots instead, see [`braille`].
fn picture(text: &MapText, max_width: usize) -> String {
    if text.map.width() > max_width {
        return braille(&text.map, max_width);
    }
    match (text.to_text(), text.rows_apart()) {
        (Ok(rows), _) => rows,
        (_, Ok([starts, goals])) if 2 * text.map.width() + 2 <= max_width => {
            let rows = starts.iter().zip(&goals).map(|(start, goal)| format!("{start}  {goal}"));
            rows.collect::<Vec<_>>().join("\n")
        }
        _ => braille(&text.map, max_width),
    }
}

/// Draws a map in braille characters. Each character has two columns and four rows of dots. Each dot covers a square of
/// cells and is set if at least half of them are obstacles.
fn braille(map: &Map, max_width: usize) -> String {
    const DOTS: [[u32; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];
    let scale = map.width().div_ceil(2 * max_width).max(1);
    let is_dark = |top: usize, left: usize| {
        let (bottom, right) = ((top + scale).min(map.height()), (left + scale).min(map.width()));
        if top >= bottom || left >= right {
            return false;
        }
        let rows = map.obstacles().chunks(map.width()).take(bottom).skip(top);
        let dark: usize = rows.map(|row| row[left..right].iter().filter(|&&obstacle| obstacle).count()).sum();
        2 * dark >= (bottom - top) * (right - left)
    };
    let character = |row: usize, col: usize| {
        let mut code = 0x2800;
        for (down, dots) in DOTS.iter().enumerate() {
            for (across, dot) in dots.iter().enumerate() {
                if is_dark((row * 4 + down) * scale, (col * 2 + across) * scale) {
                    code |= dot;
                }
            }
        }
        char::from_u32(code).unwrap_or(' ')
    };
    let (height, width) = (map.height().div_ceil(4 * scale), map.width().div_ceil(2 * scale));
    let line = |row: usize| (0..width).map(|col| character(row, col)).collect::<String>();
    (0..height).map(line).collect::<Vec<_>>().join("\n")
}
