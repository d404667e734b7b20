//! The future goals of the agents in a lifelong episode.

use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use pogema_core::{Cell, GoalStream, Instance};

use crate::config::{GridConfig, Targets};

/// Returns the goals that POGEMA foretells right after a reset.
///
/// If the config gives goal sequences, returns these sequences. Otherwise, adds up the Manhattan distances from an
/// agent's start through all goals in its list. The list ends with the first goal at which the sum is at least the
/// length of the episode. Returns `None` if the list would never end because only the goal just reached can be drawn
/// again.
///
/// Rule: goal/restart/foretold
///
/// Source: POGEMA 1.4.0, `envs.py`, `PogemaLifeLong.get_lifelong_targets_xy`
pub fn foretold_goals(config: &GridConfig, instance: &Instance) -> Option<Vec<Vec<Cell>>> {
    foretold_from(config, instance, instance.starts(), &instance.first_goals(), &AtomicBool::new(false))
}

/// Returns the goals that POGEMA foretells later in the episode.
///
/// POGEMA repeats the draws of the reset, but starts from the agents' current cells and current goals. If `stop` is
/// set, returns `None` soon.
///
/// Rule: goal/restart/foretold
pub fn foretold_from(
    config: &GridConfig,
    instance: &Instance,
    cells: &[Cell],
    goals: &[Cell],
    stop: &AtomicBool,
) -> Option<Vec<Vec<Cell>>> {
    if let Some(Targets::Sequences(sequences)) = &config.targets_xy {
        return Some(sequences.clone());
    }
    let agents = instance.goals().iter().zip(cells.iter().zip(goals));
    let goals_of = |(stream, (&cell, &goal)): (&GoalStream, (&Cell, &Cell))| {
        goals_of_agent(stream.clone(), cell, goal, config.max_episode_steps, stop)
    };
    agents.map(goals_of).collect()
}

fn goals_of_agent(
    mut stream: GoalStream,
    start: Cell,
    goal: Cell,
    max_steps: i64,
    stop: &AtomicBool,
) -> Option<Vec<Cell>> {
    /// Maximum number of equal draws in a row. If there are more, this is not chance: no other goal can be drawn.
    const MAX_REPEATS: usize = 10_000;
    let mut at = goal;
    let mut goals = vec![at];
    let mut length = i64::from(start.distance(at));
    let mut num_repeats = 0;
    while length < max_steps {
        let next = stream.advance(at);
        num_repeats = if next == at { num_repeats + 1 } else { 0 };
        if num_repeats > MAX_REPEATS || stop.load(Relaxed) {
            return None;
        }
        length += i64::from(at.distance(next));
        goals.push(next);
        at = next;
    }
    Some(goals)
}
