//! Bugs in observations.

use pogema_core::{Cell, Config, Map, Snapshot};

use crate::bug::Bug;

/// Returns the goal that the observation shows instead of the agent's goal.
pub fn shown_goal(bug: Bug, radius: usize, cell: Cell, goal: Cell) -> Cell {
    let radius = radius as i32;
    let down = i32::from(goal.row) - i32::from(cell.row);
    let right = i32::from(goal.col) - i32::from(cell.col);
    let longest = down.abs().max(right.abs());
    if longest <= radius {
        return goal;
    }
    let on_line = |away: i32| (f64::from(away * radius) / f64::from(longest)).round() as i32;
    let (down, right) = match bug {
        Bug::GoalNormalised => (on_line(down), on_line(right)),
        Bug::GoalClampedByLongerAxis if down.abs() > right.abs() => (down, 0),
        Bug::GoalClampedByLongerAxis => (0, right),
        _ => (down, right),
    };
    Cell::new((i32::from(cell.row) + down) as u16, (i32::from(cell.col) + right) as u16)
}

/// Plants a bug in the observation of one agent.
///
/// Shape: three channels of a window each.
pub fn corrupt(bug: Bug, config: &Config, map: &Map, state: &Snapshot, agent: usize, channels: &mut [f32]) {
    let side = config.side();
    let area = side * side;
    match bug {
        Bug::FinishedSeeNothing if !state.active[agent] => channels.fill(0.0),
        Bug::SelfUnseen => channels[area + area / 2] = 0.0,
        Bug::WindowTransposed => {
            for channel in channels.chunks_mut(area) {
                let seen = channel.to_vec();
                (0..area).for_each(|at| channel[at] = seen[at % side * side + at / side]);
            }
        }
        Bug::NoRing => {
            let Cell { row, col } = state.cells[agent];
            let place = |at: usize| (usize::from(row) + at / side, usize::from(col) + at % side);
            let on_ring = (0..area).filter(|&at| is_ring(config, map, place(at)));
            on_ring.for_each(|at| channels[at] = 0.0);
        }
        _ => {}
    }
}

/// Returns whether a position belongs to the wall around the map. Positions count from the corner of the border.
pub fn is_ring(config: &Config, map: &Map, (row, col): (usize, usize)) -> bool {
    let inner = |at: usize, size: usize| (config.radius..config.radius + size).contains(&at);
    let outer = |at: usize, size: usize| (config.radius..config.radius + size + 2).contains(&(at + 1));
    let (height, width) = map.sides();
    outer(row, height) && outer(col, width) && !(inner(row, height) && inner(col, width))
}
