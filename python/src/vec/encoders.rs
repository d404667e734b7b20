//! The encoders of a batch, one for each environment.

use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use pogema_core::{Environment, Error, Instance, Map, Outside, State};
use pogema_fast::{Batch, Engine};
use pogema_policies::{Encoder, EncoderSettings};

/// The memory for costs to goals that no agent currently has, for all environments together. Units: bytes.
pub(super) const CACHE_BYTES: usize = 256 << 20;

/// Encodes the states of all environments of a batch.
pub struct Encoders {
    settings: EncoderSettings,
    num_agents: usize,
    lanes: Vec<Lane>,
}

/// The caller's buffers for some environments.
///
/// Shape: `windows` is `[envs, agents, channels, side, side]`, `scalars` is `[envs, agents, scalars]`.
pub struct Encoded<'a> {
    pub windows: &'a mut [f32],
    pub scalars: &'a mut [f32],
}

/// The encoders of the next episodes, by index of the environment. An environment without a prepared encoder uses its
/// own.
pub type Prepared = Vec<Option<Encoder>>;

/// The encoder of one environment.
struct Lane {
    encoder: Encoder,
    /// The number of the environment's episode that the encoder follows, counted from 1.
    begun: u64,
    /// The step that the encoder followed last.
    step: Option<u64>,
    /// The windows and scalars at the end of the last episode.
    ended: Option<(Vec<f32>, Vec<f32>)>,
}

impl Encoders {
    pub fn new(settings: EncoderSettings, num_envs: usize, num_agents: usize) -> Result<Self, Error> {
        let encoder = || Ok(Encoder::new(settings.clone())?.with_cache_bytes(CACHE_BYTES / num_envs));
        let lane = |_| Ok(Lane { encoder: encoder()?, begun: 0, step: None, ended: None });
        let lanes = (0..num_envs).map(lane).collect::<Result<_, Error>>()?;
        Ok(Self { settings, num_agents, lanes })
    }

    /// Returns encoders for the next episodes of some environments.
    ///
    /// Pass them to the first [`Encoders::encode`] of these episodes. They do not fit any other episode.
    ///
    /// # Errors
    /// [`Error::Cancelled`] if another thread sets `stop`.
    pub fn prepare<'a>(
        &self,
        batch: &mut Batch,
        next: impl Fn(&Batch, usize) -> Option<Instance> + Sync + 'a,
        stop: &AtomicBool,
    ) -> Result<Prepared, Error> {
        let cache_bytes = CACHE_BYTES / self.lanes.len();
        let settings = &self.settings;
        let prepared = batch.share((0..self.lanes.len()).collect(), |batch, env| {
            if stop.load(Relaxed) {
                return Err(Error::Cancelled);
            }
            let Some(instance) = next(batch, env) else { return Ok(None) };
            let mut encoder = Encoder::new(settings.clone())?.with_cache_bytes(cache_bytes);
            let starts = instance.starts();
            encoder.begin(instance.map(), instance.outside(), batch.config().occupancy, starts);
            let (active, on_goal) = (vec![true; starts.len()], vec![false; starts.len()]);
            let goals = instance.first_goals();
            let state = State { step: 0, cells: starts, goals: &goals, active: &active, on_goal: &on_goal };
            encoder.follow_until(state, stop)?;
            Ok(Some(encoder))
        });
        prepared.into_iter().collect()
    }

    /// Returns the approximate work to begin the episodes of some environments, in visited cells.
    pub fn work_to_begin(&self, num_cells: usize, num_envs: usize) -> usize {
        num_cells.saturating_mul(self.num_agents).saturating_mul(num_envs)
    }

    /// Writes the windows and scalars of the current states of all environments.
    ///
    /// Call it after each reset and step, since encoders remember earlier states. Episodes that have just begun take
    /// over the `prepared` encoders.
    pub fn encode(&mut self, batch: &mut Batch, prepared: Prepared, out: Encoded<'_>) -> Result<(), Error> {
        let Self { settings, num_agents, lanes } = self;
        let (windows_len, scalars_len) =
            (*num_agents * settings.window_len(), *num_agents * settings.scalars_len());
        Error::check_length("windows", lanes.len() * windows_len, out.windows.len())?;
        Error::check_length("scalars", lanes.len() * scalars_len, out.scalars.len())?;
        let (mut windows, mut scalars) = (out.windows, out.scalars);
        let mut parts = Vec::with_capacity(lanes.len());
        let nexts = prepared.into_iter().chain(std::iter::repeat_with(|| None));
        for ((env, lane), next) in lanes.iter_mut().enumerate().zip(nexts) {
            let (of_lane, others) = std::mem::take(&mut windows).split_at_mut(windows_len);
            windows = others;
            let (numbers, others) = std::mem::take(&mut scalars).split_at_mut(scalars_len);
            scalars = others;
            parts.push((env, lane, next, Encoded { windows: of_lane, scalars: numbers }));
        }
        let done =
            batch.share(parts, |batch, (env, lane, next, out)| lane.encode(batch, env, next, settings, out));
        done.into_iter().collect()
    }

    /// Writes the windows and scalars at the ends of the last episodes of some environments.
    ///
    /// # Errors
    /// [`Error::NotEnded`] for an environment without an ended episode; [`Error::Length`] for a buffer of the wrong
    /// length.
    pub fn write_ended(&self, envs: &[usize], out: Encoded<'_>) -> Result<(), Error> {
        let Self { settings, num_agents, lanes } = self;
        let (windows_len, scalars_len) =
            (num_agents * settings.window_len(), num_agents * settings.scalars_len());
        Error::check_length("windows", envs.len() * windows_len, out.windows.len())?;
        Error::check_length("scalars", envs.len() * scalars_len, out.scalars.len())?;
        for (place, &env) in envs.iter().enumerate() {
            let ended = lanes.get(env).and_then(|lane| lane.ended.as_ref());
            let (windows, scalars) = ended.ok_or(Error::NotEnded { lane: env })?;
            out.windows[place * windows_len..][..windows_len].copy_from_slice(windows);
            out.scalars[place * scalars_len..][..scalars_len].copy_from_slice(scalars);
        }
        Ok(())
    }
}

impl Lane {
    fn encode(
        &mut self,
        batch: &Batch,
        env: usize,
        next: Option<Encoder>,
        settings: &EncoderSettings,
        mut out: Encoded<'_>,
    ) -> Result<(), Error> {
        let (engine, begun) = (batch.lane(env)?, batch.num_begun(env)?);
        let has_just_ended = batch.has_just_ended(env)?;
        if self.begun != begun {
            // With autoreset in the same step, the last episode ended in this step, too.
            if let Some((ended, _)) = batch.ended(env)?.filter(|_| has_just_ended) {
                self.write(ended, settings, &mut out)?;
                self.keep(&out);
            }
            self.begin(engine, begun, next)?;
        }
        self.write(engine, settings, &mut out)?;
        if has_just_ended && engine.num_steps() > 0 {
            self.keep(&out);
        }
        Ok(())
    }

    fn begin(&mut self, engine: &Engine, begun: u64, next: Option<Encoder>) -> Result<(), Error> {
        self.begun = begun;
        if let Some(next) = next {
            (self.encoder, self.step) = (next, Some(0));
            return Ok(());
        }
        let (map, outside) = surroundings_of(engine)?;
        self.encoder.begin(&map, &outside, engine.config().occupancy, engine.starts());
        self.step = None;
        Ok(())
    }

    /// Writes the state of an environment. The encoder follows each state only once.
    fn write(
        &mut self,
        engine: &Engine,
        settings: &EncoderSettings,
        out: &mut Encoded<'_>,
    ) -> Result<(), Error> {
        let state = engine.state();
        if self.step != Some(state.step) {
            self.encoder.follow(state)?;
            self.step = Some(state.step);
        }
        let num_agents = state.cells.len();
        let (windows, padding) = out.windows.split_at_mut(num_agents * settings.window_len());
        padding.fill(0.0);
        let (scalars, padding) = out.scalars.split_at_mut(num_agents * settings.scalars_len());
        padding.fill(0.0);
        self.encoder.write(state, windows, scalars)
    }

    fn keep(&mut self, out: &Encoded<'_>) {
        let (windows, scalars) = self.ended.get_or_insert_default();
        windows.clear();
        windows.extend_from_slice(out.windows);
        scalars.clear();
        scalars.extend_from_slice(out.scalars);
    }
}

/// Splits a map with a border, as engines show it, into the map inside and the area beyond its wall.
///
/// `padded` holds the whole map row by row, with `rows` rows and `columns` columns.
pub fn surroundings(
    padded: &[u8],
    (rows, columns): (usize, usize),
    border: usize,
) -> Result<(Map, Outside), Error> {
    Error::check_length("the map", rows * columns, padded.len())?;
    let too_small = || {
        let expected = format!("a map with its border of {border}");
        Error::argument("obstacles", format!("{rows} x {columns}"), expected)
    };
    let height = rows.checked_sub(2 * border).ok_or_else(too_small)?;
    let width = columns.checked_sub(2 * border).ok_or_else(too_small)?;
    let at = |row: usize, column: usize| padded[row * columns + column] != 0;
    let cells = (0..height).flat_map(|row| (0..width).map(move |column| (row + border, column + border)));
    let map = Map::new(height, width, cells.map(|(row, column)| at(row, column)).collect())?;
    let is_beyond = |place: usize, length: usize| place + 1 < border || place > border + length;
    let has_noise = (0..rows).any(|row| {
        (0..columns).any(|column| at(row, column) && (is_beyond(row, height) || is_beyond(column, width)))
    });
    let outside = if has_noise {
        Outside::Noise(Map::new(rows, columns, padded.iter().map(|&value| value != 0).collect())?)
    } else {
        Outside::Free
    };
    Ok((map, outside))
}

/// Returns the map of an environment and the area beyond its wall.
pub fn surroundings_of(engine: &Engine) -> Result<(Map, Outside), Error> {
    let ((height, width), border) = (engine.size(), engine.config().radius);
    let shape = (height + 2 * border, width + 2 * border);
    let mut padded = vec![0; shape.0 * shape.1];
    engine.observe_map(&mut padded)?;
    surroundings(&padded, shape, border)
}
