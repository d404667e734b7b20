//! Panels that show the states and windows of a difference.

use pogema_core::picture::marks;
use pogema_core::{Cell, Map, Snapshot};

use super::panel::{Content, Grid, Moment, Panel, Sign};
use crate::digits::unpack;
use crate::request::Response;

/// Returns a grid of the agents and goals of a state.
pub fn agents_grid(map: &Map, state: &Snapshot) -> Grid {
    grid(map, marks(map, state).into_iter().map(Sign::from))
}

fn occupancy_grid(map: &Map, state: &Snapshot) -> Grid {
    let sign_of = |&obstacle: &bool| if obstacle { Sign::Obstacle } else { Sign::Free };
    let mut signs: Vec<Sign> = map.obstacles().iter().map(sign_of).collect();
    for &cell in &state.occupied {
        signs[map.index(cell)] = Sign::Occupied;
    }
    grid(map, signs.into_iter())
}

fn grid(map: &Map, signs: impl Iterator<Item = Sign>) -> Grid {
    let signs: Vec<Sign> = signs.collect();
    signs.chunks(map.width()).map(<[Sign]>::to_vec).collect()
}

/// Returns panels of the state before an operation, and of the expected and received states after it.
pub fn states(expected: &Response, got: &Response, op: usize) -> Vec<Panel> {
    let Some(map) = expected.map_at(op) else { return Vec::new() };
    let is_on_map = |cell: &Cell| map.contains(*cell);
    let panel = |(moment, state): (Moment, Option<&Snapshot>)| {
        let state = state?;
        let can_be_drawn = [&state.cells, &state.goals, &state.occupied].into_iter().flatten().all(is_on_map);
        let grids = if can_be_drawn {
            vec![agents_grid(&map, state), occupancy_grid(&map, state)]
        } else {
            Vec::new()
        };
        Some(Panel { moment, content: Content::State, grids })
    };
    let states = [
        (Moment::Before, expected.state_before(op)),
        (Moment::Expected, expected.records[op].state()),
        (Moment::Got, got.records[op].state()),
    ];
    states.into_iter().filter_map(panel).collect()
}

/// Returns panels of the expected and received window of one agent; none for a hash or a window of another size.
pub fn windows(expected: &str, got: &str, side: usize) -> Vec<Panel> {
    if got.contains(':') || expected.len() != got.len() {
        return Vec::new();
    }
    let area = side * side;
    let sign = |&bit: &bool| if bit { Sign::Set } else { Sign::Free };
    let channel =
        |bits: &[bool]| bits.chunks(side).map(|row| row.iter().map(sign).collect()).collect::<Grid>();
    [(Moment::Expected, expected), (Moment::Got, got)]
        .map(|(moment, window)| {
            let grids = unpack(window).chunks_exact(area).map(channel).collect();
            Panel { moment, content: Content::Window, grids }
        })
        .into()
}

/// Returns the row-major index of the first value that differs.
pub fn first_differing_bit(one: &str, other: &str) -> usize {
    let (one, other) = (unpack(one), unpack(other));
    let differing = one.iter().zip(&other).position(|(one, other)| one != other);
    differing.unwrap_or(one.len().min(other.len()))
}
