//! Serializes an environment, so that it can be pickled and copied in the middle of an episode.

use pogema_core::{
    Action, CollisionMeter, DensityMeter, EpisodeMeter, Error, GoalStream, LARGEST_STEP, Map, Recording,
    Snapshot, StreamState,
};
use pogema_maps::{GridConfig, InstanceSource, SavedInstance};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::drawn::Drawn;
use super::{Engine, Inner};
use crate::guard::guarded;
use crate::{errors, interrupt};

const FORMAT: &str = "pogema-rs environment";
const VERSION: u32 = 1;

/// The complete saved state: everything that an environment's future depends on.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Saved {
    format: String,
    version: u32,
    config: Value,
    registered: Option<Map>,
    exact: bool,
    time_limit: i64,
    elapsed: u64,
    meter: EpisodeMeter,
    drawn: Drawn,
    episode: Option<SavedEpisode>,
    is_filmed: bool,
    film: Option<Recording>,
    #[serde(default)]
    is_measured: bool,
    #[serde(default)]
    density: Option<DensityMeter>,
    #[serde(default)]
    collisions: Option<CollisionMeter>,
    #[serde(default)]
    executed: Vec<Option<Action>>,
}

/// An episode that has begun.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SavedEpisode {
    instance: SavedInstance,
    step: u64,
    now: Snapshot,
    past: Vec<Snapshot>,
    streams: Vec<StreamState>,
}

guarded! {
/// Restores the environment that `Engine.__reduce__` turned into these bytes.
///
/// # Errors
/// `ValueError` for any other bytes.
#[pyfunction]
pub fn restore_engine(py: Python<'_>, saved: &[u8]) -> PyResult<Engine> {
    let restored = if saved.len() < interrupt::LONG {
        restored(saved)
    } else {
        let saved = saved.to_vec();
        interrupt::detach(py, move || restored(&saved))?
    };
    restored.map(Engine::of).map_err(|error| errors::call(py, &error))
}
}

impl Inner {
    /// Returns the complete state as versioned JSON.
    pub(super) fn save<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let saved = self.saved().map_err(|error| errors::call(py, &error))?;
        Ok(PyBytes::new(py, saved.as_bytes()))
    }

    fn saved(&self) -> Result<String, Error> {
        let mut config = self.source.config().to_value();
        // Pools keep the order into which resets have shuffled them.
        if let Some((starts, goals)) = self.source.pools() {
            config["possible_agents_xy"] = json!(starts);
            config["possible_targets_xy"] = json!(goals);
        }
        let Self { episode, .. } = self;
        let begun = episode.instance().ok().map(|instance| {
            Ok::<_, Error>(SavedEpisode {
                instance: SavedInstance::of(instance)?,
                step: episode.num_steps(),
                now: episode.snapshot(),
                past: episode.past().to_vec(),
                streams: episode.engine().streams().iter().map(GoalStream::save).collect::<Result<_, _>>()?,
            })
        });
        let saved = Saved {
            format: FORMAT.to_owned(),
            version: VERSION,
            config,
            registered: self.source.registered().cloned(),
            exact: self.exact,
            time_limit: self.time_limit,
            elapsed: episode.state().step,
            meter: episode.meters().episode.clone(),
            drawn: self.drawn.clone(),
            episode: begun.transpose()?,
            is_filmed: self.is_filmed,
            film: episode.recording().cloned(),
            is_measured: self.is_measured,
            density: episode.meters().density.clone(),
            collisions: episode.meters().collisions,
            executed: self.executed.clone(),
        };
        serde_json::to_string(&saved).map_err(|error| foreign(&error.to_string()))
    }
}

fn foreign(reason: &str) -> Error {
    Error::Corrupt { what: "these bytes are not a saved environment".into(), reason: reason.to_owned() }
}

fn restored(saved: &[u8]) -> Result<Inner, Error> {
    let saved: Value = serde_json::from_slice(saved).map_err(|error| foreign(&error.to_string()))?;
    if saved["format"] != FORMAT || saved["version"] != VERSION {
        return Err(foreign(&format!("expected the format `{FORMAT}`, version {VERSION}")));
    }
    let saved: Saved = serde_json::from_value(saved).map_err(|error| foreign(&error.to_string()))?;
    let source = InstanceSource::new(GridConfig::from_value(&saved.config)?, saved.registered)?;
    let mut engine = Inner::new(source, saved.exact, saved.time_limit)?;
    let rules = *engine.episode.config();
    let fits = saved.meter.num_agents() == rules.num_agents
        && saved.drawn.fits(if saved.episode.is_some() { rules.num_agents } else { 0 }, rules.persistent)
        && (saved.executed.is_empty() || saved.executed.len() == rules.num_agents);
    if !fits {
        return Err(foreign("the number of agents, or whether steps are kept, differs from the config"));
    }
    let steps = [Some(saved.elapsed), saved.episode.as_ref().map(|episode| episode.step)];
    let collisions = saved.collisions.map(|meter| [meter.with_agents, meter.with_obstacles]);
    let mut counts = steps.into_iter().flatten().chain(collisions.into_iter().flatten());
    if !saved.meter.is_plausible() || counts.any(|count| count > LARGEST_STEP) {
        return Err(foreign(&format!("a count is larger than {LARGEST_STEP}")));
    }
    (engine.drawn, engine.executed) = (saved.drawn, saved.executed);
    (engine.is_filmed, engine.is_measured) = (saved.is_filmed, saved.is_measured);
    let meters = engine.episode.meters_mut();
    meters.episode = saved.meter;
    (meters.density, meters.collisions) = (saved.density, saved.collisions);
    if let Some(episode) = saved.episode {
        resume(&mut engine, episode, saved.elapsed, saved.film)?;
    }
    Ok(engine)
}

fn resume(
    engine: &mut Inner,
    episode: SavedEpisode,
    elapsed: u64,
    recording: Option<Recording>,
) -> Result<(), Error> {
    let SavedEpisode { instance, step, now, past, streams: states } = episode;
    let instance = engine.source.restore(instance)?;
    let mut streams = instance.goals().to_vec();
    Error::check_length("streams", streams.len(), states.len())?;
    for (stream, state) in streams.iter_mut().zip(&states) {
        stream.restore(state)?;
    }
    engine.episode.engine_mut().resume(&instance, streams, elapsed, &now)?;
    engine.episode.resume(instance, step, past, recording)
}
