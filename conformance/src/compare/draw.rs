//! Panels that show the states and windows of a difference.

use std::collections::BTreeMap;

use pogema_core::{Cell, Map, Snapshot};

use super::panel::{Content, Covered, Grid, Moment, Panel, Sign};
use crate::digits::unpack;
use crate::request::{Record, Response};

/// Returns a grid of the agents and goals of a state. Active agents hide goals, and goals hide finished agents. Among
/// signs of one kind, the lower index hides the higher one. The grid lists the hidden signs.
fn agents_grid(map: &Map, state: &Snapshot) -> Grid {
    let mut stacks: BTreeMap<usize, Vec<Sign>> = BTreeMap::new();
    let mut put = |cells: &[Cell], are_active: bool, sign: fn(u32) -> Sign| {
        for (agent, &cell) in cells.iter().enumerate().rev() {
            if state.active[agent] == are_active && map.contains(cell) {
                stacks.entry(map.index(cell)).or_default().push(sign(agent as u32));
            }
        }
    };
    put(&state.cells, false, Sign::Finished);
    put(&state.goals, true, Sign::Goal);
    put(&state.cells, true, Sign::Agent);
    let mut signs: Vec<Sign> = map.obstacles().iter().copied().map(ground).collect();
    let mut covered = Vec::new();
    for (at, mut stack) in stacks {
        let Some(top) = stack.pop() else { continue };
        signs[at] = top;
        // From top to bottom.
        stack.reverse();
        stack.extend(map.obstacles()[at].then_some(Sign::Obstacle));
        if !stack.is_empty() {
            covered.push(Covered { row: at / map.width(), column: at % map.width(), under: stack });
        }
    }
    grid(map, &signs, covered)
}

fn occupancy_grid(map: &Map, state: &Snapshot) -> Grid {
    let mut signs: Vec<Sign> = map.obstacles().iter().copied().map(ground).collect();
    for &cell in &state.occupied {
        let at = map.index(cell);
        signs[at] = if map.obstacles()[at] { Sign::OccupiedObstacle } else { Sign::Occupied };
    }
    grid(map, &signs, Vec::new())
}

fn ground(is_obstacle: bool) -> Sign {
    if is_obstacle { Sign::Obstacle } else { Sign::Free }
}

fn grid(map: &Map, signs: &[Sign], covered: Vec<Covered>) -> Grid {
    Grid { rows: signs.chunks(map.width()).map(<[Sign]>::to_vec).collect(), covered }
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
    // The state before a reset belongs to another episode, and possibly to another map.
    let is_reset = matches!(expected.records.get(op), Some(Record::Reset(_)));
    let states = [
        (Moment::Before, expected.state_before(op).filter(|_| !is_reset)),
        (Moment::Expected, expected.records.get(op).and_then(Record::state)),
        (Moment::Got, got.records.get(op).and_then(Record::state)),
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
        |bits: &[bool]| Grid::of_rows(bits.chunks(side).map(|row| row.iter().map(sign).collect()).collect());
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
