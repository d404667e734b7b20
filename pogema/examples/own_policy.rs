//! Plays an episode with your own greedy policy: each agent moves closer to its goal unless obstacles block every such
//! move.

use pogema::{Action, Environment, Episode, Error, GridConfig};

/// Chooses, for each agent, the first action that leads closer to the goal and onto a free cell.
fn act<E: Environment>(episode: &Episode<E>, windows: &mut [f32]) -> Result<Vec<Action>, Error> {
    let (config, state) = (episode.config(), episode.state());
    // Shape: [agents, 3, side, side]; the agent is in the centre of its window.
    episode.engine().observe(windows)?;
    let (side, radius) = (config.side(), config.radius as i32);
    let is_free = |agent: usize, action: Action| {
        let (down, right) = action.delta();
        let index = (radius + down) as usize * side + (radius + right) as usize;
        windows[agent * 3 * side * side + index] == 0.0
    };
    let leads_closer = |agent: usize, action: Action| {
        let (cell, goal) = (state.cells[agent], state.goals[agent]);
        let distance =
            |(row, col): (i32, i32)| (row - i32::from(goal.row)).abs() + (col - i32::from(goal.col)).abs();
        distance(cell.toward(action)) < distance(cell.toward(Action::Stay))
    };
    let best = |agent: usize| {
        let fits = |action: &Action| leads_closer(agent, *action) && is_free(agent, *action);
        Action::ALL.into_iter().find(fits).unwrap_or_default()
    };
    Ok((0..config.num_agents).map(best).collect())
}

pub(crate) fn main() -> Result<(), Error> {
    let config =
        GridConfig::from_yaml("{size: 16, density: 0.1, num_agents: 8, seed: 3, collision_system: soft}")?;
    let mut episode = pogema::start(&config)?;
    let mut windows = vec![0.0; episode.config().num_observed()];
    while !episode.is_over() {
        let actions = act(&episode, &mut windows)?;
        episode.step(&actions)?;
    }
    println!("{:?}", episode.metrics());
    assert!(episode.metrics().isr > Some(0.5));
    Ok(())
}
