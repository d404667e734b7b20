//! Generators and readers of maps; each map is returned as text.

use pogema_core::{Cell, Error, Map};
use pogema_maps::formats::{Water, read_movingai, without_outermost_cells};
use pogema_maps::generators::{Bays, Maze, RandomMap, Warehouse};
use pogema_maps::parse_map_text;
use pyo3::prelude::*;

use crate::guard::guarded;
use crate::{errors, interrupt, memory};

type Cells = Vec<(u16, u16)>;

/// Makes a map and returns its text. Works outside the main thread, so that a signal ends a long call.
fn text(py: Python<'_>, make: impl FnOnce() -> Result<Map, Error> + Send + 'static) -> PyResult<String> {
    let text = interrupt::detach(py, move || Ok(make()?.rows().join("\n")))?;
    text.map_err(|error: Error| errors::map(py, &error))
}

/// Checks that a map fits in memory.
fn check_size(width: i64, height: i64) -> PyResult<()> {
    memory::check("the map", memory::of_map(width, height)).map_err(|error| errors::memory(&error))
}

guarded! {
/// Returns a map with obstacles at random cells.
#[pyfunction]
pub fn random_map(
    py: Python<'_>,
    sides: (i64, i64),
    obstacle_density: f64,
    seed: u64,
) -> PyResult<String> {
    let (width, height) = sides;
    check_size(width, height)?;
    let map = RandomMap { width, height, obstacle_density, seed };
    text(py, move || map.generate())
}
}

guarded! {
/// Returns a maze with straight walls.
#[pyfunction]
pub fn maze(
    py: Python<'_>,
    sides: (i64, i64),
    obstacle_density: f64,
    wall_components: i64,
    go_straight: f64,
    seed: u64,
) -> PyResult<String> {
    let (width, height) = sides;
    check_size(width, height)?;
    let maze = Maze { width, height, obstacle_density, wall_components, go_straight, seed };
    text(py, move || maze.generate())
}
}

guarded! {
/// Returns a warehouse without possible starts and goals.
#[pyfunction]
pub fn warehouse(py: Python<'_>, settings: [i64; 7]) -> PyResult<String> {
    if let Ok((height, width)) = read_warehouse(settings).and_then(|warehouse| warehouse.sides())
        && height.max(width) <= Map::LONGEST_SIDE
    {
        check_size(width as i64, height as i64)?;
    }
    text(py, move || Ok(read_warehouse(settings)?.generate(Bays::None)?.map))
}
}

guarded! {
/// Returns the cells in the bays of a warehouse, and those next to its shelves.
#[pyfunction]
pub fn warehouse_cells(
    py: Python<'_>,
    map: &str,
    bottom_gap: i64,
    vertical_gap: i64,
) -> PyResult<(Cells, Cells)> {
    let map = map.to_owned();
    let find = move || {
        let warehouse = read_warehouse([0, 0, 0, 0, bottom_gap, 0, vertical_gap])?;
        warehouse.cells(&parse_map_text(&map)?.map, Bays::Toolbox)
    };
    let (starts, goals) = interrupt::detach(py, find)?.map_err(|error: Error| errors::map(py, &error))?;
    let pairs = |cells: Vec<Cell>| cells.into_iter().map(|cell| (cell.row, cell.col)).collect();
    Ok((pairs(starts), pairs(goals)))
}
}

guarded! {
/// Returns a map of MovingAI's benchmark, without the ring of cells at its border if `has_ring` is false.
#[pyfunction]
pub fn movingai_map(py: Python<'_>, file: &str, has_ring: bool) -> PyResult<String> {
    let file = file.to_owned();
    text(py, move || {
        let map = read_movingai(&file, Water::Free)?;
        if has_ring { Ok(map) } else { without_outermost_cells(&map) }
    })
}
}

/// Reads the settings of a warehouse, in the order of pogema-toolbox.
fn read_warehouse(settings: [i64; 7]) -> Result<Warehouse, Error> {
    let names = [
        "wall_width",
        "wall_height",
        "walls_in_row",
        "walls_rows",
        "bottom_gap",
        "horizontal_gap",
        "vertical_gap",
    ];
    let mut sizes = [0; 7];
    for ((size, value), name) in sizes.iter_mut().zip(settings).zip(names) {
        *size = usize::try_from(value).map_err(|_| Error::argument(name, value, "a whole number from 0"))?;
    }
    let [wall_width, wall_height, walls_in_row, walls_rows, bottom_gap, horizontal_gap, vertical_gap] = sizes;
    Ok(Warehouse {
        wall_width,
        wall_height,
        walls_in_row,
        walls_rows,
        bottom_gap,
        horizontal_gap,
        vertical_gap,
    })
}
