//! Plays episodes for pages and tests.

use std::collections::HashMap;

use pogema_core::{Action, Cell, Environment, Episode, Error, Map, Snapshot, Trace};
use pogema_maps::{GridConfig, InstanceSource, distances_to};
use pogema_numpy::{Generator, NumpyError};
use pogema_reference::Reference;

/// Plays an episode of a config to its end. Agents take shortest paths, and a random action with probability `stray`.
pub fn play(yaml: &str, stray: f64) -> Result<Trace, Error> {
    let config = GridConfig::from_yaml(yaml)?;
    let (seed, rules) = (config.seed.unwrap_or_default(), config.rules());
    let instance = InstanceSource::new(config, None)?.generate()?.instance;
    let mut episode = Episode::new(Reference::new(rules)?).with_recording();
    episode.start(instance)?;
    let mut walkers = Walkers { generator: Generator::seeded(seed), stray, distances: HashMap::new() };
    while !episode.is_over() {
        let actions = walkers.act(episode.instance()?.map(), &episode.snapshot());
        episode.step(&actions.map_err(|error| Error::external("random numbers", error))?)?;
    }
    episode.trace()
}

/// Returns the reference engine's observations after the reset and after each step of an episode: for each agent its
/// three windows, one after the other, as zeros and ones.
#[allow(dead_code, reason = "the unit tests share this file and use no observations")]
pub fn observe(trace: &Trace) -> Result<Vec<Vec<String>>, Error> {
    let config = trace.header.config;
    let mut episode = Episode::new(Reference::new(config)?);
    episode.start(trace.header.instance()?)?;
    let mut values = vec![0.0; config.num_observed()];
    let mut all = Vec::new();
    for actions in std::iter::once(None).chain(trace.steps.iter().map(|step| Some(&step.actions))) {
        if let Some(actions) = actions {
            episode.step(actions)?;
        }
        episode.engine().observe(&mut values)?;
        let window =
            |values: &[f32]| values.iter().map(|&value| if value == 0.0 { '0' } else { '1' }).collect();
        all.push(values.chunks(values.len() / config.num_agents).map(window).collect());
    }
    Ok(all)
}

/// Agents on shortest paths, with random actions in between.
struct Walkers {
    generator: Generator,
    stray: f64,
    /// For each goal, the distance of every cell.
    distances: HashMap<Cell, Vec<u32>>,
}

impl Walkers {
    fn act(&mut self, map: &Map, state: &Snapshot) -> Result<Vec<Action>, NumpyError> {
        let mut actions = Vec::with_capacity(state.cells.len());
        for (&cell, &goal) in state.cells.iter().zip(&state.goals) {
            let strays = self.generator.random() < self.stray;
            let first = self.generator.integers(0, 5)? as usize;
            let to_goal = self.distances.entry(goal).or_insert_with(|| distances_to(map, goal));
            let length =
                |action: &Action| neighbour(map, cell, *action).map_or(u32::MAX, |at| to_goal[map.index(at)]);
            // Start with a random action, so that ties between shortest paths break at random.
            let choices = (0..5).map(|add| Action::ALL[(first + add) % 5]);
            let best = choices.min_by_key(length).unwrap_or_default();
            actions.push(if strays { Action::ALL[first] } else { best });
        }
        Ok(actions)
    }
}

fn neighbour(map: &Map, cell: Cell, action: Action) -> Option<Cell> {
    Cell::checked(cell.toward(action)).filter(|&cell| !map.is_obstacle(cell))
}
