//! `pogema maps generate`: generates maps with the generators of the POGEMA paper.

use std::ops::Range;
use std::path::PathBuf;

use clap::Args;
use indicatif::HumanBytes;
use pogema_conformance::files::write_with;
use pogema_core::{Error, listed};
use pogema_maps::MapText;
use pogema_maps::formats::{NamedMap, set_entry, write_set};
use pogema_maps::generators::{Bays, MazeRanges, Preset, RandomRanges, Warehouse, seed_name};

use super::write_out;
use crate::output::{check_writable, is_closed, print_bytes, tell, with_flag};
use crate::words::word;

#[derive(Args, Debug)]
pub struct Generate {
    /// Map set of the paper (validation-random, training-random, validation-mazes, training-mazes, warehouse), or
    /// generator (random, mazes, shelves)
    what: String,
    /// Range of seeds for `random` and `mazes`; the end is excluded [default: 0..1]
    #[arg(long, value_name = "A..B", value_parser = seeds)]
    seeds: Option<Range<u64>>,
    /// Prefix of the names for `random` and `mazes`, name of the map for `shelves` [default: the generator's name]
    #[arg(long)]
    name: Option<String>,
    /// Write to this file instead of standard output
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    ranges: Ranges,
    #[command(flatten)]
    shelves: Shelves,
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
    /// Free columns on each side of the shelves, left and right [default: 5]
    #[arg(long, value_name = "N")]
    bottom_gap: Option<usize>,
    /// Columns between shelves [default: 1]
    #[arg(long, value_name = "N")]
    horizontal_gap: Option<usize>,
    /// Rows between, above and below shelves [default: 3]
    #[arg(long, value_name = "N")]
    vertical_gap: Option<usize>,
    /// Cells that are marked for starts and goals [default: none]
    #[arg(long, value_parser = word::<Bays>())]
    bays: Option<Bays>,
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

/// Names of flags, and whether each flag is given.
type Flags = Vec<(&'static str, bool)>;

/// Returns the names of some flags, and whether each flag is given.
macro_rules! flags {
    ($flags:expr => $($name:ident)+) => { vec![$((stringify!($name), $flags.$name.is_some())),+] };
}

impl Generate {
    pub fn run(&self) -> Result<(), Error> {
        self.check_flags()?;
        match self.what.as_str() {
            "random" => {
                let ranges = given!(self.ranges => RandomRanges: width_min width_max height_min height_max
                    obstacle_density_min obstacle_density_max);
                self.write_seeds(|seed| ranges.sample(seed).map_err(with_flag)?.generate().map(MapText::from))
            }
            "mazes" => {
                let ranges = given!(self.ranges => MazeRanges: width_min width_max height_min height_max
                    obstacle_density_min obstacle_density_max wall_components_min wall_components_max
                    go_straight_min go_straight_max);
                self.write_seeds(|seed| ranges.sample(seed).map_err(with_flag)?.generate().map(MapText::from))
            }
            "shelves" => {
                let warehouse = given!(self.shelves => Warehouse: wall_width wall_height walls_in_row walls_rows
                    bottom_gap horizontal_gap vertical_gap);
                let name = self.name.clone().unwrap_or_else(|| "shelves".into());
                let map = NamedMap {
                    name,
                    text: warehouse.generate(self.shelves.bays.unwrap_or_default()).map_err(with_flag)?,
                };
                write_out(self.out.as_deref(), set_entry(&map)?.as_bytes())
            }
            preset => {
                write_out(self.out.as_deref(), write_set(&Preset::by_name(preset)?.maps()?)?.as_bytes())
            }
        }
    }

    /// Checks that the generator uses all flags that are given.
    fn check_flags(&self) -> Result<(), Error> {
        if !["random", "mazes", "shelves"].contains(&self.what.as_str()) {
            Preset::by_name(&self.what)?;
        }
        let groups: [(&[&str], Flags); 5] = [
            (&["random", "mazes"], flags!(self => seeds)),
            (&["random", "mazes", "shelves"], flags!(self => name)),
            (
                &["random", "mazes"],
                flags!(self.ranges => width_min width_max height_min height_max obstacle_density_min
                    obstacle_density_max),
            ),
            (
                &["mazes"],
                flags!(self.ranges => wall_components_min wall_components_max go_straight_min go_straight_max),
            ),
            (
                &["shelves"],
                flags!(self.shelves => wall_width wall_height walls_in_row walls_rows bottom_gap horizontal_gap
                    vertical_gap bays),
            ),
        ];
        for (generators, flags) in groups {
            let given = flags.into_iter().find(|(_, is_given)| *is_given);
            if let (Some((flag, _)), false) = (given, generators.contains(&self.what.as_str())) {
                let flag = flag.replace('_', "-");
                let generators: Vec<String> = generators.iter().map(|name| format!("`{name}`")).collect();
                return Err(Error::request(format!("`--{flag}` is only for {}", listed(&generators))));
            }
        }
        Ok(())
    }

    /// Writes the map of each seed as soon as it is generated.
    fn write_seeds(&self, generate: impl Fn(u64) -> Result<MapText, Error>) -> Result<(), Error> {
        let prefix = self.name.as_deref().unwrap_or(&self.what);
        let seeds = self.seeds.clone().unwrap_or(0..1);
        let entry =
            |seed| set_entry(&NamedMap { name: seed_name(prefix, seed, &seeds), text: generate(seed)? });
        let num_maps = seeds.end - seeds.start;
        if num_maps > MANY {
            let bytes = num_maps.saturating_mul(entry(seeds.start)?.len() as u64);
            tell(&format!("note: {num_maps} maps to generate, about {} in all", HumanBytes(bytes)));
        }
        let mut entries = seeds.clone().map(entry);
        let Some(path) = &self.out else {
            let mut entries = entries.take_while(|_| !is_closed());
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
