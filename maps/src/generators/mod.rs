//! The map generators of pogema-toolbox 0.1.1. For each seed and setting, the map is the same as there.
//!
//! | Here | In pogema-toolbox |
//! | --- | --- |
//! | [`RandomRanges`], [`RandomMap`] | `MapRangeSettings`, `generate_map` |
//! | [`MazeRanges`], [`Maze`] | `MazeRangeSettings`, `MazeGenerator.generate_maze` |
//! | [`Warehouse`] | `WarehouseConfig`, `generate_warehouse`, `generate_wfi_warehouse` |
//! | [`Preset`] | the `main` functions: the paper's map sets under their published names and in their published sizes |

mod maze;
mod preset;
mod random;
mod warehouse;

pub use maze::{Maze, MazeRanges};
pub use preset::{Preset, seed_name};
pub use random::{RandomMap, RandomRanges};
pub use warehouse::{Bays, Warehouse};

use std::fmt::Display;

use pogema_core::{Error, Map};

use pogema_numpy::Generator;

/// Checks that `width` and `height` are within the limits of a map.
fn check_sides(width: i64, height: i64) -> Result<(), Error> {
    let longest = Map::LONGEST_SIDE as i64;
    for (field, side) in [("width", width), ("height", height)] {
        if !(1..=longest).contains(&side) {
            return Err(Error::argument(field, side, format!("a whole number from 1 to {longest}")));
        }
    }
    Ok(())
}

/// Draws a whole number from `lowest` to `highest`, both included.
fn draw_between(generator: &mut Generator, field: &str, (lowest, highest): (i64, i64)) -> Result<i64, Error> {
    let end = highest.checked_add(1).filter(|_| lowest <= highest);
    let drawn = end.and_then(|end| generator.integers(lowest, end).ok());
    drawn.ok_or_else(|| wrong_range(field, lowest, highest, "below 2^63 - 1"))
}

/// Draws a number from `lowest` to `highest`.
fn draw_share(generator: &mut Generator, field: &str, (lowest, highest): (f64, f64)) -> Result<f64, Error> {
    generator.uniform(lowest, highest).map_err(|_| {
        let ends = [("min", lowest), ("max", highest)];
        match ends.into_iter().find(|(_, number)| !number.is_finite()) {
            Some((end, number)) => Error::argument(&format!("{field}_{end}"), number, "a finite number"),
            None => wrong_range(field, lowest, highest, "a smaller number"),
        }
    })
}

/// Returns the error of a range that is empty or whose maximum is not as expected.
fn wrong_range<T: Display + PartialOrd>(field: &str, lowest: T, highest: T, expected: &str) -> Error {
    if lowest <= highest {
        return Error::argument(&format!("{field}_max"), highest, expected);
    }
    Error::argument(&format!("{field}_min"), lowest, format!("at most {field}_max, which is {highest}"))
}
