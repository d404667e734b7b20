//! The reference, and the fast engine on every SIMD path, played in lockstep.

use std::fmt::Debug;
use std::ops::Range;

use pogema_core::{Action, Config, Environment, Error, Instance, Seen, Snapshot, StepResults};
use pogema_fast::{Engine, SimdPath, words_per_agent};
use pogema_reference::Reference;

/// The initial value of buffers, to detect values that an engine does not write.
const UNWRITTEN: u8 = 7;

/// A result whose error describes a difference.
pub type Outcome<T> = Result<T, String>;

/// The reference and the fast engines with the same config, in the same state.
pub struct Pair {
    pub reference: Reference,
    pub engines: Vec<(SimdPath, Engine)>,
    /// Rows and columns of the map; 0 before the first reset.
    size: (usize, usize),
    /// The states since the reset.
    past: Vec<Snapshot>,
}

impl Pair {
    pub fn new(config: Config) -> Self {
        let available = SimdPath::ALL.into_iter().filter(|path| path.is_available());
        let engines = available.map(|path| (path, Engine::with_path(config, path).unwrap())).collect();
        Self { reference: Reference::new(config).unwrap(), engines, size: (0, 0), past: Vec::new() }
    }

    pub fn config(&self) -> Config {
        *self.reference.config()
    }

    pub fn reset(&mut self, instance: &Instance) -> Outcome<()> {
        self.size = (instance.map().height(), instance.map().width());
        let expected = self.reference.reset(instance);
        for (path, engine) in &mut self.engines {
            same(*path, "reset", &expected, &engine.reset(instance))?;
        }
        let state = self.check_state()?;
        if expected.is_ok() {
            self.past = vec![state];
        }
        Ok(())
    }

    pub fn step(&mut self, actions: &[Action]) -> Outcome<(Snapshot, StepResults)> {
        let expected = results(&mut self.reference, actions);
        for (path, engine) in &mut self.engines {
            same(*path, "results of the step", &expected, &results(engine, actions))?;
        }
        let results = expected.map_err(|error| error.to_string())?;
        let state = self.check_state()?;
        self.past.push(state.clone());
        Ok((state, results))
    }

    pub fn step_back(&mut self) -> Outcome<()> {
        if self.past.len() > 1 {
            self.past.pop();
        }
        let before = self.past.last().cloned().unwrap_or_default();
        let step = self.past.len().saturating_sub(1) as u64;
        let expected = self.reference.restore(step, &before);
        for (path, engine) in &mut self.engines {
            same(*path, "step back", &expected, &engine.restore(step, &before))?;
        }
        self.check_state().map(|_| ())
    }

    /// Compares the states.
    pub fn check_state(&self) -> Outcome<Snapshot> {
        let expected = self.reference.snapshot();
        for (path, engine) in &self.engines {
            same(*path, "state", &expected, &engine.snapshot())?;
            same(*path, "step", &self.reference.state().step, &engine.state().step)?;
        }
        Ok(expected)
    }

    /// Compares all observations; those of the agents `some` also separately.
    pub fn check_observations(&self, some: Range<usize>) -> Outcome<()> {
        let config = self.config();
        let mut expected = vec![f32::from(UNWRITTEN); config.num_observed()];
        let outcome = self.reference.observe(&mut expected);
        for (path, engine) in &self.engines {
            let mut actual = vec![f32::from(UNWRITTEN); config.num_observed()];
            same(*path, "observing", &outcome, &engine.observe(&mut actual))?;
            same(*path, "observation", &bits_of(&expected), &bits_of(&actual))?;
        }
        if outcome.is_ok() {
            self.check_ranges(&expected, &[0..config.num_agents, some])?;
        }
        let expected_map = map_of(&self.reference, config, self.size);
        let expected_seen = seen_by(&self.reference);
        for (path, engine) in &self.engines {
            same(*path, "map with its border", &expected_map, &map_of(engine, config, self.size))?;
            same(*path, "counts of what is seen", &expected_seen, &seen_by(engine))?;
            if outcome.is_ok() {
                check_windows(*path, engine, config, &expected)?;
            }
        }
        Ok(())
    }

    fn check_ranges(&self, whole: &[f32], ranges: &[Range<usize>]) -> Outcome<()> {
        let per_agent = whole.len() / self.config().num_agents;
        for agents in ranges {
            let expected = &whole[agents.start * per_agent..agents.end * per_agent];
            for (path, engine) in &self.engines {
                let mut values = vec![f32::from(UNWRITTEN); expected.len()];
                let mut bytes = vec![UNWRITTEN; expected.len()];
                let mut words = vec![u64::MAX; agents.len() * words_per_agent(self.config().radius)];
                let observed = engine
                    .observe_agents(agents.clone(), &mut values)
                    .and_then(|()| engine.observe_agents(agents.clone(), &mut bytes))
                    .and_then(|()| engine.observe_bits(agents.clone(), &mut words));
                observed.map_err(|error| error.to_string())?;
                let from_bytes: Vec<f32> = bytes.iter().map(|&byte| f32::from(byte)).collect();
                same(*path, "f32 of some agents", &bits_of(expected), &bits_of(&values))?;
                same(*path, "u8 of some agents", &expected, &from_bytes.as_slice())?;
                same(
                    *path,
                    "bits of some agents",
                    &expected,
                    &unpack(&words, agents.len(), per_agent)?.as_slice(),
                )?;
            }
        }
        Ok(())
    }
}

/// Checks that the fast engine returns the same value as the reference.
fn same<T: PartialEq + Debug>(path: SimdPath, what: &str, expected: &T, actual: &T) -> Outcome<()> {
    if expected == actual {
        return Ok(());
    }
    Err(format!("{path}: difference in the {what}\n reference: {expected:?}\n      fast: {actual:?}"))
}

fn results(environment: &mut impl Environment, actions: &[Action]) -> Result<StepResults, Error> {
    let num_agents = actions.len();
    // The opposite of the usual results, to detect places that an engine does not write.
    let flags = vec![true; num_agents];
    let mut results =
        StepResults { rewards: vec![-1.0; num_agents], terminated: flags.clone(), truncated: flags };
    environment.step(actions, results.out())?;
    Ok(results)
}

fn map_of(
    environment: &impl Environment,
    config: Config,
    (height, width): (usize, usize),
) -> Result<Vec<u8>, Error> {
    let border = 2 * config.radius;
    let mut obstacles = vec![UNWRITTEN; (height + border) * (width + border)];
    environment.observe_map(&mut obstacles).map(|()| obstacles)
}

fn seen_by(environment: &impl Environment) -> Result<Vec<Seen>, Error> {
    let mut seen = Vec::new();
    environment.count_seen(&mut seen).map(|()| seen)
}

/// Checks that the separate windows of `POMAPF` equal those of the `default` observation.
fn check_windows(path: SimdPath, engine: &Engine, config: Config, default: &[f32]) -> Outcome<()> {
    let area = config.side() * config.side();
    let channel =
        |index: usize| default.chunks(area).skip(index).step_by(3).flatten().copied().collect::<Vec<f32>>();
    let expected = [channel(0), channel(1)];
    let mut actual = expected.clone().map(|values| vec![f32::from(UNWRITTEN); values.len()]);
    let [obstacles, agents] = &mut actual;
    engine.observe_windows(obstacles, agents).map_err(|error| error.to_string())?;
    same(path, "windows of POMAPF", &expected, &actual)
}

/// Returns the bits of values, to distinguish 0 from -0.
fn bits_of(values: &[f32]) -> Vec<u32> {
    values.iter().map(|value| value.to_bits()).collect()
}

/// Unpacks the values of some agents from their bits; unused bits must be 0.
fn unpack(words: &[u64], num_agents: usize, per_agent: usize) -> Outcome<Vec<f32>> {
    let mut values = Vec::with_capacity(num_agents * per_agent);
    for words in words.chunks(per_agent.div_ceil(64)) {
        let bit = |index: usize| words[index / 64] >> (index % 64) & 1;
        values.extend((0..per_agent).map(|index| f32::from(bit(index) as u8)));
        if (per_agent..64 * words.len()).any(|index| bit(index) != 0) {
            return Err("a bit after the last value is set".into());
        }
    }
    Ok(values)
}
