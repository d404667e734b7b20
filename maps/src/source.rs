//! Generates the instances of a config, one for each reset.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use pogema_core::{Cell, Error, GoalStream, Instance, Map, OnGoal, Outside, StreamState, counted};
use serde::{Deserialize, Serialize};

use crate::components::Components;
use crate::config::{GridConfig, Targets};
use crate::drawn_goals::{Choice, DrawnGoals, Reach};
use crate::place::{capacity, place_at_random};
use pogema_numpy::{Generator, SeedSequence};

/// POGEMA's default number of further attempts to place the agents.
const NUM_RETRIES: usize = 10;
/// Exclusive upper bound of the seeds of the agents' generators: the largest `int32`.
const AGENT_SEEDS: i64 = i32::MAX as i64;

/// An instance and the warnings from generating it.
#[derive(Clone, Debug)]
pub struct Generated {
    /// The instance.
    pub instance: Instance,
    /// Warnings that POGEMA gives too, one line each. Cells are given in coordinates without the border.
    pub warnings: Vec<String>,
}

/// The parts of an instance, for saving it and restoring it later.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SavedInstance {
    map: Map,
    outside: Outside,
    starts: Vec<Cell>,
    goals: Vec<Cell>,
    states: Vec<StreamState>,
}

impl SavedInstance {
    /// Returns the parts of an instance.
    ///
    /// # Errors
    /// If its goals come from a source that cannot be saved.
    pub fn of(instance: &Instance) -> Result<Self, Error> {
        Ok(Self {
            map: instance.map().clone(),
            outside: instance.outside().clone(),
            starts: instance.starts().to_vec(),
            goals: instance.first_goals(),
            states: instance.goals().iter().map(GoalStream::save).collect::<Result<_, _>>()?,
        })
    }
}

/// Generates the instances of a config. Each call of [`InstanceSource::generate`] is one reset of POGEMA.
///
/// Rule: seed/streams, seed/reset
///
/// Source: POGEMA 1.4.0, `grid.py`, `Grid.__init__` and `GridLifeLong.__init__`
#[derive(Clone, Debug)]
pub struct InstanceSource {
    config: GridConfig,
    registered: Option<Map>,
    pools: Option<Pools>,
    num_retries: usize,
    cancelled: Option<Arc<AtomicBool>>,
}

/// Possible starts and goals in their current order. Every reset that places agents from these pools shuffles the pools
/// again.
#[derive(Clone, Debug)]
struct Pools {
    starts: Vec<Cell>,
    goals: Vec<Cell>,
}

impl InstanceSource {
    /// Creates a source for a config.
    ///
    /// `registered` is the map named by the config's `map_name`; it replaces the config's own map.
    ///
    /// # Errors
    /// If the config names a map but `registered` is `None`.
    ///
    /// Rule: grid/named
    pub fn new(config: GridConfig, registered: Option<Map>) -> Result<Self, Error> {
        if let (Some(name), None) = (&config.map_name, &registered) {
            return Err(Error::config("map_name", name, "the name of a registered map"));
        }
        let pools =
            config.pools().map(|(starts, goals)| Pools { starts: starts.to_vec(), goals: goals.to_vec() });
        let registered = registered.filter(|_| config.map_name.is_some());
        Ok(Self { config, registered, pools, num_retries: NUM_RETRIES, cancelled: None })
    }

    /// Sets the number of further attempts to place the agents on new random maps [default: 10].
    ///
    /// Rule: place/retries
    #[must_use]
    pub fn with_retries(mut self, num_retries: usize) -> Self {
        self.num_retries = num_retries;
        self
    }

    /// Registers a flag that cancels [`InstanceSource::generate`]: once any thread has set the flag, no further random
    /// attempt begins.
    #[must_use]
    pub fn cancelled_by(mut self, flag: &Arc<AtomicBool>) -> Self {
        self.cancelled = Some(Arc::clone(flag));
        self
    }

    /// Returns the config.
    pub fn config(&self) -> &GridConfig {
        &self.config
    }

    /// Sets the seed of the following resets. Pools keep their shuffled order from earlier resets.
    ///
    /// Rule: seed/streams
    pub fn reseed(&mut self, seed: Option<u64>) {
        self.config.seed = seed;
    }

    /// Returns the largest number of cells that [`InstanceSource::generate`] draws or shuffles, all attempts included.
    pub fn num_cells_drawn(&self) -> usize {
        let (height, width) = self.given_map().map_or((self.config.height, self.config.width), Map::sides);
        let area = |border: usize| (height + border).saturating_mul(width + border);
        let outside = if self.config.empty_outside { 0 } else { area(2 * self.config.obs_radius) };
        area(0).saturating_mul(self.num_further_attempts().saturating_add(1)).saturating_add(outside)
    }

    /// Returns the possible starts and goals in their current order, as shuffled by the resets so far.
    ///
    /// Rule: place/pools
    pub fn pools(&self) -> Option<(&[Cell], &[Cell])> {
        self.pools.as_ref().map(|pools| (&pools.starts[..], &pools.goals[..]))
    }

    /// Returns the registered map that replaces the config's own.
    ///
    /// Rule: grid/named
    pub fn registered(&self) -> Option<&Map> {
        self.registered.as_ref()
    }

    /// Restores an instance that this source generated before.
    ///
    /// # Errors
    /// If its parts do not fit the config or each other.
    pub fn restore(&self, made: SavedInstance) -> Result<Instance, Error> {
        let SavedInstance { map, outside, starts, goals, states } = made;
        let mut streams = self.streams(&map, &goals, self.pools.as_ref())?;
        Error::check_length("goals", states.len(), streams.len())?;
        for (stream, state) in streams.iter_mut().zip(&states) {
            stream.restore(state)?;
        }
        Instance::new(map, outside, starts, streams)
    }

    /// Generates the instance of the next reset.
    ///
    /// # Errors
    /// If there are too many agents for the map, if starts or goals do not fit the map or each other, or if a next goal
    /// could never be drawn; [`Error::Cancelled`] if a thread has cancelled the call. An error leaves the source
    /// unchanged.
    ///
    /// Rule: place/obstacles, place/explicit, place/pools, place/retries
    pub fn generate(&mut self) -> Result<Generated, Error> {
        let mut warnings = Vec::new();
        let mut pools = self.pools.clone();
        let (map, starts, goals) = match (self.config.explicit_placement(), &mut pools) {
            (Some((starts, targets)), _) => self.place_explicitly(starts, &targets.first(), &mut warnings)?,
            (None, Some(pools)) => self.place_from_pools(pools)?,
            (None, None) => self.place_at_random(&mut warnings)?,
        };
        let outside = self.outside(&map)?;
        let streams = self.streams(&map, &goals, pools.as_ref())?;
        let instance = Instance::new(map, outside, starts, streams)?;
        self.warn_of_unreachable(&instance, &mut warnings);
        self.pools = pools;
        Ok(Generated { instance, warnings })
    }

    /// Returns a fresh random stream; with a seed, always the same one.
    ///
    /// Rule: seed/streams
    fn stream(&self) -> Result<Generator, Error> {
        match self.config.seed {
            Some(seed) => Ok(Generator::seeded(seed)),
            None => random_sequence().map(|sequence| Generator::from_sequence(&sequence)),
        }
    }

    /// Returns the registered map, or that of the config, if there is one.
    fn given_map(&self) -> Option<&Map> {
        self.registered.as_ref().or(self.config.map.as_ref())
    }

    /// Returns the number of further attempts to place the agents at random.
    fn num_further_attempts(&self) -> usize {
        // With a seed all attempts are equal, and on a given map the room never changes.
        if self.given_map().is_none() && self.config.seed.is_none() { self.num_retries } else { 0 }
    }

    /// Returns the map before starts and goals clear any of its cells.
    ///
    /// Rule: place/obstacles
    fn ground(&self) -> Result<Map, Error> {
        if let Some(map) = self.given_map() {
            return Ok(map.clone());
        }
        let (height, width) = (self.config.height, self.config.width);
        self.noise(height, width)
    }

    fn noise(&self, height: usize, width: usize) -> Result<Map, Error> {
        let mut obstacles = Vec::with_capacity(height * width);
        let mut generator = self.stream()?;
        let density = self.config.density;
        generator
            .binomial1_array(density, height * width, |obstacle| obstacles.push(obstacle))
            .map_err(|error| Error::config("density", density, error.to_string()))?;
        Map::new(height, width, obstacles)
    }

    /// Returns the cells outside the map.
    ///
    /// Rule: border/outside, border/noise
    fn outside(&self, map: &Map) -> Result<Outside, Error> {
        if self.config.empty_outside {
            return Ok(Outside::Free);
        }
        let border = 2 * self.config.obs_radius;
        self.noise(map.height() + border, map.width() + border).map(Outside::Noise)
    }

    /// Places the agents on explicit starts and goals, and clears obstacles there.
    ///
    /// Rule: place/explicit
    fn place_explicitly(
        &self,
        starts: &[Cell],
        goals: &[Cell],
        warnings: &mut Vec<String>,
    ) -> Result<Placed, Error> {
        let num_agents = self.config.num_agents;
        if goals.len() != starts.len() {
            let expected = format!("a list of {}, one for each agent in agents_xy", starts.len());
            return Err(Error::config("targets_xy", format_args!("a list of {}", goals.len()), expected));
        }
        if num_agents > starts.len() {
            let expected = format!("at most {}, the number of agents in agents_xy", starts.len());
            return Err(Error::config("num_agents", num_agents, expected));
        }
        let mut map = self.ground()?;
        for (agent, (&start, &goal)) in starts.iter().zip(goals).enumerate().take(num_agents) {
            for (what, cell) in [("start", start), ("goal", goal)] {
                if !map.contains(cell) {
                    return Err(Error::outside(agent, what, cell, map.height(), map.width()));
                }
                if map.clear(cell) && self.config.map.is_some() {
                    warnings.push(format!(
                        "the {what} of agent {agent} is on an obstacle, cell {cell} counted without the border; \
                         the cell becomes free"
                    ));
                }
            }
        }
        Ok((map, starts[..num_agents].to_vec(), goals[..num_agents].to_vec()))
    }

    /// Draws starts and goals from the pools.
    ///
    /// Rule: place/pools
    ///
    /// Source: POGEMA 1.4.0, `generator.py`, `generate_from_possible_positions`
    fn place_from_pools(&self, pools: &mut Pools) -> Result<Placed, Error> {
        let num_agents = self.config.num_agents;
        let map = self.ground()?;
        for (what, pool) in [("possible_agents_xy", &pools.starts), ("possible_targets_xy", &pools.goals)] {
            check_on_map(map.sides(), what, pool)?;
            if pool.len() < num_agents {
                let expected = format!("at most {}, the number of cells in {what}", pool.len());
                return Err(Error::config("num_agents", num_agents, expected));
            }
        }
        let mut generator = self.stream()?;
        generator.shuffle(&mut pools.starts);
        generator.shuffle(&mut pools.goals);
        Ok((map, pools.starts[..num_agents].to_vec(), pools.goals[..num_agents].to_vec()))
    }

    /// Places the agents at random, with as many attempts as POGEMA.
    ///
    /// Rule: place/retries
    fn place_at_random(&self, warnings: &mut Vec<String>) -> Result<Placed, Error> {
        let num_agents = self.config.num_agents;
        let num_retries = self.num_further_attempts();
        let mut room = 0;
        for attempt in 0..=num_retries {
            if self.cancelled.as_ref().is_some_and(|flag| flag.load(Relaxed)) {
                return Err(Error::Cancelled);
            }
            let map = self.ground()?;
            let components = Components::of(&map);
            room = room.max(capacity(&components));
            let placed = place_at_random(&map, &components, num_agents, &mut self.stream()?);
            if let Some((starts, goals)) = placed {
                if (1..num_retries).contains(&attempt) {
                    warnings.push(format!("the agents were placed only at attempt {}", attempt + 1));
                }
                return Ok((map, starts, goals));
            }
        }
        Err(Error::config("num_agents", num_agents, format!("at most {room}; the map has no room for more")))
    }

    /// Returns the goal stream of each agent.
    ///
    /// Rule: goal/restart/draw, goal/restart/pool, goal/restart/sequence, seed/goals
    fn streams(&self, map: &Map, goals: &[Cell], pools: Option<&Pools>) -> Result<Vec<GoalStream>, Error> {
        if self.config.on_target != OnGoal::Restart {
            return Ok(goals.iter().copied().map(GoalStream::single).collect());
        }
        if let Some(targets) = &self.config.targets_xy {
            return sequences(goals, targets);
        }
        let seeds = self.stream()?.integers_array(0, AGENT_SEEDS, goals.len());
        let seeds = seeds.map_err(|error| Error::instance(error.to_string()))?;
        let pool = pools.map(|pools| &pools.goals).or(self.config.possible_targets_xy.as_ref());
        let (choice, reason) = if let Some(pool) = pool {
            check_on_map(map.sides(), "possible_targets_xy", pool)?;
            let pool = Choice::Pool { cells: pool.clone().into(), radius: self.config.obs_radius as u16 };
            (pool, "no next goal can be drawn from possible_targets_xy")
        } else {
            let reach = Choice::Reach(Arc::new(Reach::new(Components::of(map))));
            (reach, "no next goal can be drawn: its goal has no free neighbour")
        };
        if let Some(agent) = goals.iter().position(|&goal| !choice.can_draw(goal)) {
            return Err(Error::agent(agent, reason));
        }
        let source = |seed: i64| Box::new(DrawnGoals::new(Generator::seeded(seed as u64), choice.clone()));
        Ok(goals.iter().zip(seeds).map(|(&goal, seed)| GoalStream::drawn(goal, source(seed))).collect())
    }

    fn warn_of_unreachable(&self, instance: &Instance, warnings: &mut Vec<String>) {
        if self.pools.is_none() && self.config.explicit_placement().is_none() {
            // Random pairs are always connected.
            return;
        }
        let components = Components::of(instance.map());
        for (agent, (&start, goal)) in instance.starts().iter().zip(instance.first_goals()).enumerate() {
            if components.label(start) != components.label(goal) {
                warnings.push(format!(
                    "agent {agent} cannot reach its goal: no path from cell {start} to cell {goal}, both counted \
                     without the border"
                ));
            }
        }
    }
}

/// Returns an unpredictable seed sequence from the operating system.
///
/// # Errors
/// [`Error::External`] if the operating system provides none.
pub fn random_sequence() -> Result<SeedSequence, Error> {
    SeedSequence::from_os().map_err(|error| Error::external("random seed", error))
}

type Placed = (Map, Vec<Cell>, Vec<Cell>);

/// Returns the goal streams of explicit sequences.
///
/// Rule: goal/restart/sequence
fn sequences(first: &[Cell], targets: &Targets) -> Result<Vec<GoalStream>, Error> {
    let Targets::Sequences(sequences) = targets else {
        return Err(Error::config(
            "targets_xy",
            "one goal per agent",
            "goal sequences with on_target `restart`",
        ));
    };
    if sequences.len() < first.len() {
        let expected = format!("{}, one for each agent", counted(first.len(), "sequence"));
        return Err(Error::config("targets_xy", counted(sequences.len(), "sequence"), expected));
    }
    let stream = |(&goal, cells): (&Cell, &Vec<Cell>)| GoalStream::sequence(goal, cells.clone().into());
    Ok(first.iter().zip(sequences).map(stream).collect())
}

/// Checks that every cell of a field is on a map of the given height and width.
pub(crate) fn check_on_map(
    (height, width): (usize, usize),
    field: &str,
    cells: &[Cell],
) -> Result<(), Error> {
    match cells.iter().find(|cell| !cell.is_within(height, width)) {
        Some(cell) => Err(Error::cell_outside(field, cell, (height, width))),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may panic")]

    use super::*;

    #[test]
    fn cells_of_all_attempts_and_of_the_outside_are_counted() {
        let num_drawn = |text: &str, registered| {
            let config = GridConfig::from_yaml(text).unwrap();
            InstanceSource::new(config, registered).unwrap().num_cells_drawn()
        };
        assert_eq!(num_drawn("{}", None), 11 * 64);
        assert_eq!(num_drawn("seed: 0", None), 64);
        assert_eq!(num_drawn("map: '...'", None), 3);
        assert_eq!(num_drawn("{seed: 0, empty_outside: false, obs_radius: 2}", None), 64 + 144);
        let large = Map::new(100, 90, vec![false; 9000]).unwrap();
        assert_eq!(num_drawn("map_name: large", Some(large)), 9000);
    }
}
