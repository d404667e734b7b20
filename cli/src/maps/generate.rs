//! `pogema maps generate`: generates maps with the generators of the POGEMA paper.

use std::ops::Range;
use std::path::PathBuf;

use clap::Args;
use indicatif::HumanBytes;
use pogema_conformance::files::write_with;
use pogema_core::Error;
use pogema_maps::MapText;
use pogema_maps::formats::{NamedMap, set_entry, write_set};
use pogema_maps::generators::{Bays, MazeRanges, Preset, RandomRanges, Warehouse, seed_name};

use super::write_out;
use crate::output::{check_writable, print_bytes, tell};
use crate::words::word;

#[derive(Args, Debug)]
pub struct Generate {
    /// Map set of the paper (validation-random, training-random, validation-mazes, training-mazes, warehouse), or
    /// generator (random, mazes, shelves)
    what: String,
    /// Range of seeds for `random` and `mazes`; the end is excluded
    #[arg(long, value_name = "A..B", value_parser = seeds, default_value = "0..1")]
    seeds: Range<u64>,
    /// Prefix of the names for `random` and `mazes`, name of the map for `shelves` [default: the generator's name]
    #[arg(long)]
    name: Option<String>,
    #[command(flatten)]
    ranges: Ranges,
    #[command(flatten)]
    shelves: Shelves,
    /// Write to this file instead of standard output
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// The settings of random maps and mazes, under the names of pogema-toolbox.
#[derive(Args, Debug)]
#[command(next_help_heading = "Random maps and mazes")]
struct Ranges {
    /// Smallest width [default: 17; mazes: 5]
    #[arg(long, value_name = "N")]
    width_min: Option<i64>,
    /// Largest width [default: 21; mazes: 9]
    #[arg(long, value_name = "N")]
    width_max: Option<i64>,
    /// Smallest height [default: 17; mazes: 5]
    #[arg(long, value_name = "N")]
    height_min: Option<i64>,
    /// Largest height [default: 21; mazes: 9]
    #[arg(long, value_name = "N")]
    height_max: Option<i64>,
    /// Smallest share of obstacles [default: 0.1; mazes: 0]
    #[arg(long, value_name = "P")]
    obstacle_density_min: Option<f64>,
    /// Largest share of obstacles [default: 0.3; mazes: 1]
    #[arg(long, value_name = "P")]
    obstacle_density_max: Option<f64>,
    /// Smallest number of wall components, mazes only [default: 1]
    #[arg(long, value_name = "N")]
    wall_components_min: Option<i64>,
    /// Largest number of wall components, mazes only [default: 8]
    #[arg(long, value_name = "N")]
    wall_components_max: Option<i64>,
    /// Smallest weight of extending a wall straight ahead, mazes only [default: 0.75]
    #[arg(long, value_name = "P")]
    go_straight_min: Option<f64>,
    /// Largest weight of extending a wall straight ahead, mazes only [default: 0.85]
    #[arg(long, value_name = "P")]
    go_straight_max: Option<f64>,
}

/// The settings of warehouses, under the names of pogema-toolbox.
#[derive(Args, Debug)]
#[command(next_help_heading = "Shelves")]
struct Shelves {
    /// Columns of a shelf [default: 5]
    #[arg(long, value_name = "N")]
    wall_width: Option<usize>,
    /// Rows of a shelf [default: 2]
    #[arg(long, value_name = "N")]
    wall_height: Option<usize>,
    /// Shelves side by side [default: 5]
    #[arg(long, value_name = "N")]
    walls_in_row: Option<usize>,
    /// Shelves one below the other [default: 5]
    #[arg(long, value_name = "N")]
    walls_rows: Option<usize>,
    /// Columns to the left and right of all shelves [default: 5]
    #[arg(long, value_name = "N")]
    bottom_gap: Option<usize>,
    /// Columns between shelves [default: 1]
    #[arg(long, value_name = "N")]
    horizontal_gap: Option<usize>,
    /// Rows between, above and below shelves [default: 3]
    #[arg(long, value_name = "N")]
    vertical_gap: Option<usize>,
    /// Cells in which agents may start and have their goals
    #[arg(long, default_value_t, value_parser = word::<Bays>())]
    bays: Bays,
}

/// The maximum number of maps that are generated without a note on their number and size.
const MANY: u64 = 10_000;

fn seeds(text: &str) -> Result<Range<u64>, String> {
    let wrong = || "expected two whole numbers such as 0..128, the first one smaller".to_owned();
    let (first, end) = text.split_once("..").ok_or_else(wrong)?;
    let seeds = first.parse().map_err(|_| wrong())?..end.parse().map_err(|_| wrong())?;
    if seeds.is_empty() { Err(wrong()) } else { Ok(seeds) }
}

/// Creates settings from the flags that are given and the type's defaults.
macro_rules! given {
    ($flags:expr => $Settings:ident: $($name:ident)+) => {{
        let mut settings = $Settings::default();
        $(settings.$name = $flags.$name.unwrap_or(settings.$name);)+
        settings
    }};
}

impl Generate {
    pub fn run(&self) -> Result<(), Error> {
        match self.what.as_str() {
            "random" => {
                let ranges = given!(self.ranges => RandomRanges: width_min width_max height_min height_max
                    obstacle_density_min obstacle_density_max);
                self.write_seeds(|seed| ranges.sample(seed)?.generate().map(MapText::from))
            }
            "mazes" => {
                let ranges = given!(self.ranges => MazeRanges: width_min width_max height_min height_max
                    obstacle_density_min obstacle_density_max wall_components_min wall_components_max
                    go_straight_min go_straight_max);
                self.write_seeds(|seed| ranges.sample(seed)?.generate().map(MapText::from))
            }
            "shelves" => {
                let warehouse = given!(self.shelves => Warehouse: wall_width wall_height walls_in_row walls_rows
                    bottom_gap horizontal_gap vertical_gap);
                let name = self.name.clone().unwrap_or_else(|| "shelves".into());
                let map = NamedMap { name, text: warehouse.generate(self.shelves.bays)? };
                write_out(self.out.as_deref(), set_entry(&map)?.as_bytes())
            }
            preset => {
                write_out(self.out.as_deref(), write_set(&Preset::by_name(preset)?.maps()?)?.as_bytes())
            }
        }
    }

    /// Writes the map of each seed as soon as it is generated.
    fn write_seeds(&self, generate: impl Fn(u64) -> Result<MapText, Error>) -> Result<(), Error> {
        let prefix = self.name.as_deref().unwrap_or(&self.what);
        let entry =
            |seed| set_entry(&NamedMap { name: seed_name(prefix, seed, &self.seeds), text: generate(seed)? });
        let num_maps = self.seeds.end - self.seeds.start;
        if num_maps > MANY {
            let bytes = num_maps.saturating_mul(entry(self.seeds.start)?.len() as u64);
            tell(&format!("note: {num_maps} maps to generate, about {} in all", HumanBytes(bytes)));
        }
        let mut entries = self.seeds.clone().map(entry);
        let Some(path) = &self.out else {
            return entries.try_for_each(|entry| print_bytes(entry?.as_bytes()));
        };
        check_writable(path)?;
        write_with(path, |file| {
            entries.try_for_each(|entry| {
                file.write_all(entry?.as_bytes()).map_err(|error| Error::io(path, error))
            })
        })
    }
}
