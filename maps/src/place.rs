//! Places starts and goals at random.

use pogema_core::{Cell, Map};

use crate::components::Components;
use pogema_numpy::Generator;

/// Draws starts and first goals; returns `None` if the map has no room for all agents.
///
/// Visits the free cells in shuffled order. If the last start in the cell's component has no goal yet, the cell becomes
/// the goal of that start. Otherwise it becomes a start, unless enough starts were found or the component is full. Time
/// and memory are linear in the number of cells.
///
/// Rule: place/order, place/pairs
///
/// Source: POGEMA 1.4.0, `generator.py`, `generate_positions_and_targets_fast` and `placing`
pub fn place_at_random(
    map: &Map,
    components: &Components,
    num_agents: usize,
    generator: &mut Generator,
) -> Option<(Vec<Cell>, Vec<Cell>)> {
    const NO_AGENT: u32 = u32::MAX;
    if num_agents > capacity(components) {
        return None;
    }
    let mut order: Vec<u32> =
        (0..map.obstacles().len() as u32).filter(|&at| !map.obstacles()[at as usize]).collect();
    generator.shuffle(&mut order);
    let mut num_left = components.sizes().to_vec();
    let mut waiting = vec![NO_AGENT; components.len()];
    let mut starts = Vec::with_capacity(num_agents);
    let mut goals = vec![Cell::new(0, 0); num_agents];
    let mut num_goals = 0;
    for at in order {
        let Some(label) = components.label_at(at as usize) else { continue };
        let label = label as usize;
        let cell = map.cell_at(at as usize);
        if waiting[label] != NO_AGENT {
            goals[waiting[label] as usize] = cell;
            waiting[label] = NO_AGENT;
            num_goals += 1;
        } else if starts.len() < num_agents && num_left[label] >= 2 {
            num_left[label] -= 2;
            waiting[label] = starts.len() as u32;
            starts.push(cell);
        }
        if num_goals == num_agents {
            break;
        }
    }
    Some((starts, goals))
}

/// Returns the largest number of agents that fit on a map: each needs two cells of one component.
///
/// Rule: place/retries
pub fn capacity(components: &Components) -> usize {
    components.sizes().iter().map(|&size| size as usize / 2).sum()
}
