//! Where agents start and want to go, drawn at random.

use pogema_core::{Cell, Map};

use crate::components::Components;
use pogema_numpy::Generator;

/// Draws starts and first goals: cell after cell of the shuffled free cells is a start, or the goal of the last
/// start of its component. None if the map has no room for so many agents.
///
/// Time and memory are linear in the map.
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
    const NOBODY: u32 = u32::MAX;
    if num_agents > capacity(components) {
        return None;
    }
    let mut order: Vec<u32> =
        (0..map.obstacles().len() as u32).filter(|&at| !map.obstacles()[at as usize]).collect();
    generator.shuffle(&mut order);
    let mut num_left = components.sizes().to_vec();
    let mut waiting = vec![NOBODY; components.len()];
    let mut starts = Vec::with_capacity(num_agents);
    let mut goals = vec![Cell::new(0, 0); num_agents];
    let mut num_goals = 0;
    for at in order {
        let Some(label) = components.label_at(at as usize) else { continue };
        let label = label as usize;
        let cell = map.cell_at(at as usize);
        if waiting[label] != NOBODY {
            goals[waiting[label] as usize] = cell;
            waiting[label] = NOBODY;
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

/// How many agents fit: each takes two cells of a component.
///
/// Rule: place/retries
pub fn capacity(components: &Components) -> usize {
    components.sizes().iter().map(|&size| size as usize / 2).sum()
}
