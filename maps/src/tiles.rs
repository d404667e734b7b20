//! Cuts large maps into tiles.

use pogema_core::{Error, Map, rows_and_columns};

use crate::formats::NamedMap;
use crate::text::MapText;

/// Side of the tiles in the published set. Units: cells.
pub const PUBLISHED_TILE: usize = 64;

/// Cuts a map into square tiles, row by row, named `<name>_00` and so on.
///
/// # Errors
/// [`Error::Argument`] if the side does not divide both sides of the map, because cells would be lost.
///
/// Source: POGEMA benchmark, `04-movingai`, which is `06-pathfinding` in tiles of 64 × 64
pub fn tiles(name: &str, map: &Map, side: usize) -> Result<Vec<NamedMap>, Error> {
    let (height, width) = map.sides();
    if side == 0 || height % side != 0 || width % side != 0 {
        let expected = format!("a side that divides the {} of `{name}`", rows_and_columns(height, width));
        return Err(Error::argument("side", side, expected));
    }
    let num_across = width / side;
    let num_tiles = (height / side) * num_across;
    let num_digits = num_tiles.saturating_sub(1).to_string().len().max(2);
    let cut = |number: usize| {
        let (top, left) = (number / num_across * side, number % num_across * side);
        let rows = map.obstacles().chunks(width).skip(top).take(side);
        let obstacles = rows.flat_map(|row| row[left..left + side].iter().copied()).collect();
        let text = MapText::from(Map::new(side, side, obstacles)?);
        Ok(NamedMap { name: format!("{name}_{number:0num_digits$}"), text })
    };
    (0..num_tiles).map(cut).collect()
}
