//! Encoders, which compute what a policy observes: windows and scalars for each agent.
//!
//! An [`Encoder`] turns the states of one environment into windows and scalars of its agents. It needs no engine: it
//! reads a map and the [`State`] after each step, so an episode, a lane of a batch and a replay all give the same
//! bytes.

pub(crate) mod costs;
mod memory;
mod offsets;
mod path;
mod settings;
mod words;

use std::sync::atomic::AtomicBool;

use pogema_core::{Cell, Error, Map, Occupancy, Outside, State};

use costs::{Costs, write_plain, write_tracer};
use memory::Memory;
use offsets::{offset, scalars, write_goal};
use path::{draw_path, shortest_path};
pub use settings::EncoderSettings;
pub use words::{Channel, Scalars};

use crate::follower::{FollowerPlanner, FollowerVersion};
use crate::grid::{Layout, Marks};

/// An encoder for one environment.
///
/// [`Encoder::begin`] starts an episode. Then call [`Encoder::encode`] once for the state after the reset and once
/// after each step, because some channels remember earlier states. Encoding uses neither random numbers nor threads.
///
/// ```
/// use pogema_core::{Cell, Map, Occupancy, Outside, State};
/// use pogema_policies::{Channel, Encoder, EncoderSettings};
///
/// let map = Map::from_rows(&["..#", "...", "#.."])?;
/// let mut encoder = Encoder::new(EncoderSettings::new(1, [Channel::Obstacles, Channel::Goal]))?;
/// let (cells, goals) = ([Cell::new(0, 0)], [Cell::new(1, 2)]);
/// encoder.begin(&map, &Outside::Free, Occupancy::default(), &cells);
/// let mut windows = [0.0; 2 * 3 * 3];
/// let state = State { step: 0, cells: &cells, goals: &goals, active: &[true], on_goal: &[false] };
/// encoder.encode(state, &mut windows, &mut [])?;
/// assert_eq!(windows[..9], [1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
/// assert_eq!(windows[9..], [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
/// # Ok::<(), pogema_core::Error>(())
/// ```
#[derive(Debug)]
pub struct Encoder {
    settings: EncoderSettings,
    cache_bytes: usize,
    episode: Option<Episode>,
}

/// The memory of an episode.
#[derive(Debug)]
struct Episode {
    terrain: Terrain,
    starts: Vec<Cell>,
    marks: Option<Marks>,
    /// The marks of all active agents, for the channel `all_agents`.
    all_marks: Option<Marks>,
    memories: Vec<Memory>,
    /// Scratch buffer for the costs of one window.
    window: Vec<i32>,
    /// The step of the state that was followed last.
    followed: Option<u64>,
}

/// The data that depend only on the settings, the map and its outside. Consecutive episodes on the same map with the
/// same outside share them.
#[derive(Debug)]
struct Terrain {
    map: Map,
    outside: Outside,
    layout: Layout,
    obstacles: Vec<f32>,
    costs: Option<Costs>,
    follower: Option<FollowerPlanner>,
}

impl Encoder {
    /// Creates an encoder.
    ///
    /// # Errors
    /// [`Error::Config`] naming the first setting that is out of range.
    pub fn new(settings: EncoderSettings) -> Result<Self, Error> {
        settings.check()?;
        Ok(Self { settings, cache_bytes: Costs::DEFAULT_BYTES, episode: None })
    }

    /// Limits the memory for cached costs of goals that no agent currently has [default: 64 MiB]. The windows do not
    /// depend on it.
    #[must_use]
    pub fn with_cache_bytes(self, cache_bytes: usize) -> Self {
        Self { cache_bytes, ..self }
    }

    /// Returns the settings.
    pub fn settings(&self) -> &EncoderSettings {
        &self.settings
    }

    /// Starts an episode: forgets the last one, and prepares the map.
    ///
    /// `starts` holds the cell of each agent after the reset. For [`Outside::Noise`], an engine's map with its border
    /// is accepted, too: the encoder draws the wall and reads only the cells beyond it.
    pub fn begin(&mut self, map: &Map, outside: &Outside, occupancy: Occupancy, starts: &[Cell]) {
        let settings = &self.settings;
        let last = self.episode.take().map(|episode| episode.terrain);
        let last = last.filter(|last| last.map == *map && last.outside == *outside);
        let mut terrain = last.unwrap_or_else(|| Terrain::new(settings, self.cache_bytes, map, outside));
        let layout = terrain.layout;
        if let Some(costs) = &mut terrain.costs {
            costs.begin();
        }
        if let Some(follower) = &mut terrain.follower {
            let seen = match settings.follower {
                FollowerVersion::Cpp => Occupancy::Exact,
                FollowerVersion::Python => occupancy,
            };
            follower.begin(starts.len(), Marks::new(layout, seen));
        }
        let remembers = settings.has(&[Channel::SeenObstacles]);
        self.episode = Some(Episode {
            terrain,
            starts: starts.to_vec(),
            marks: settings
                .has(&[Channel::Agents, Channel::SeenAgents])
                .then(|| Marks::new(layout, occupancy)),
            all_marks: settings.has(&[Channel::AllAgents]).then(|| Marks::new(layout, Occupancy::Exact)),
            memories: if remembers { vec![Memory::new(); starts.len()] } else { Vec::new() },
            window: vec![0; settings.side() * settings.side()],
            followed: None,
        });
    }

    /// Writes the windows and the scalars of all agents; those of an inactive agent are 0.
    ///
    /// This is [`Encoder::follow`] and then [`Encoder::write`].
    ///
    /// Shape: `windows` is `[agents, channels, side, side]`, `scalars` is `[agents, scalars, 2]`.
    ///
    /// # Errors
    /// [`Error::NotReset`] before [`Encoder::begin`]; [`Error::Length`] for a buffer or a list of the wrong length;
    /// [`Error::Agent`] for a cell or a goal outside the map. After an error, the
    /// state of the encoder is unchanged.
    pub fn encode(
        &mut self,
        state: State<'_>,
        windows: &mut [f32],
        scalars: &mut [f32],
    ) -> Result<(), Error> {
        let num_agents = self.check(state)?;
        self.check_buffers(num_agents, windows, scalars)?;
        self.follow(state)?;
        self.write(state, windows, scalars)
    }

    /// Advances to a state and writes nothing.
    ///
    /// # Errors
    /// Those of [`Encoder::encode`].
    pub fn follow(&mut self, state: State<'_>) -> Result<(), Error> {
        self.follow_until(state, &AtomicBool::new(false))
    }

    /// Advances to a state, unless another thread sets `stop`. Many new goals on a large map take seconds.
    ///
    /// # Errors
    /// Those of [`Encoder::encode`]; [`Error::Cancelled`] if the work was stopped. In that case, call
    /// [`Encoder::begin`] again before the next state.
    pub fn follow_until(&mut self, state: State<'_>, stop: &AtomicBool) -> Result<(), Error> {
        self.check(state)?;
        let Self { settings, episode, .. } = self;
        let episode = episode.as_mut().ok_or(Error::NotReset)?;
        episode.follow(state, settings, stop)
    }

    /// Checks that a state fits the episode, and returns the number of agents.
    fn check(&self, state: State<'_>) -> Result<usize, Error> {
        let episode = self.episode.as_ref().ok_or(Error::NotReset)?;
        let num_agents = episode.starts.len();
        Error::check_length("cells", num_agents, state.cells.len())?;
        Error::check_length("goals", num_agents, state.goals.len())?;
        Error::check_length("active", num_agents, state.active.len())?;
        episode.terrain.layout.check_inside("cell", state.cells)?;
        episode.terrain.layout.check_inside("goal", state.goals)?;
        Ok(num_agents)
    }

    fn check_buffers(&self, num_agents: usize, windows: &[f32], scalars: &[f32]) -> Result<(), Error> {
        let settings = &self.settings;
        Error::check_length("windows", num_agents * settings.window_len(), windows.len())?;
        Error::check_length("scalars", num_agents * settings.scalars_len(), scalars.len())
    }

    /// Writes the windows and the scalars of the state that the encoder followed last. You can call this method
    /// repeatedly.
    ///
    /// # Errors
    /// Those of [`Encoder::encode`]; [`Error::OutOfStep`] for a state that the encoder did not follow last.
    pub fn write(&mut self, state: State<'_>, windows: &mut [f32], scalars: &mut [f32]) -> Result<(), Error> {
        let num_agents = self.check(state)?;
        self.check_buffers(num_agents, windows, scalars)?;
        let Self { settings, episode, .. } = self;
        let episode = episode.as_mut().ok_or(Error::NotReset)?;
        if episode.followed != Some(state.step) {
            let expected = episode.followed.map_or_else(
                || "an earlier call of `follow`".to_owned(),
                |step| format!("that of step {step}, which was followed last"),
            );
            let reason = format!("found the state of step {}, expected {expected}", state.step);
            return Err(Error::OutOfStep { reason });
        }
        if settings.window_len() > 0 {
            for (agent, out) in windows.chunks_exact_mut(settings.window_len()).enumerate() {
                episode.write_windows(agent, state, settings, out);
            }
        }
        if settings.scalars_len() > 0 {
            for (agent, out) in scalars.chunks_exact_mut(settings.scalars_len()).enumerate() {
                episode.write_scalars(agent, state, settings, out);
            }
        }
        Ok(())
    }
}

impl Terrain {
    fn new(settings: &EncoderSettings, cache_bytes: usize, map: &Map, outside: &Outside) -> Self {
        let layout = Layout::new(map, settings.radius.max(settings.sight));
        let needs_costs = settings.has(&[Channel::CostToGo, Channel::CostTracer, Channel::Path]);
        let follower = settings
            .has(&[Channel::FollowerPath])
            .then(|| FollowerPlanner::new(layout, map, settings.sight, settings.follower, cache_bytes));
        Self {
            map: map.clone(),
            outside: outside.clone(),
            layout,
            obstacles: layout.obstacles(map, outside),
            costs: needs_costs.then(|| Costs::with_budget(layout, map, cache_bytes)),
            follower,
        }
    }
}

impl Episode {
    fn follow(
        &mut self,
        state: State<'_>,
        settings: &EncoderSettings,
        stop: &AtomicBool,
    ) -> Result<(), Error> {
        self.followed = None;
        let Terrain { layout, obstacles, costs, follower, .. } = &mut self.terrain;
        for marks in self.marks.iter_mut().chain(&mut self.all_marks) {
            marks.follow(state);
        }
        if let Some(costs) = costs {
            costs.follow_until(state, stop)?;
        }
        if let Some(follower) = follower {
            follower.plan(state, stop)?;
        }
        for (agent, memory) in self.memories.iter_mut().enumerate().filter(|(agent, _)| state.active[*agent])
        {
            let cell = state.cells[agent];
            let at = offset(self.starts[agent], cell);
            memory.see(*layout, obstacles, layout.place(cell), at, settings.sight);
        }
        self.followed = Some(state.step);
        Ok(())
    }

    fn write_windows(&mut self, agent: usize, state: State<'_>, settings: &EncoderSettings, out: &mut [f32]) {
        if !state.active[agent] {
            return out.fill(0.0);
        }
        let area = settings.side() * settings.side();
        for (&channel, window) in settings.channels.iter().zip(out.chunks_exact_mut(area)) {
            self.write_window(channel, agent, state, (settings.radius, settings.sight), window);
        }
    }

    fn write_window(
        &mut self,
        channel: Channel,
        agent: usize,
        state: State<'_>,
        (radius, sight): (usize, usize),
        window: &mut [f32],
    ) {
        let Terrain { layout, obstacles, costs, .. } = &self.terrain;
        let (cell, goal, layout) = (state.cells[agent], state.goals[agent], *layout);
        let place = layout.place(cell);
        match (channel, &self.marks, &self.all_marks, costs) {
            (Channel::Obstacles, ..) => layout.copy_window(obstacles, place, window),
            (Channel::Agents, Some(marks), ..) | (Channel::AllAgents, _, Some(marks), _) => {
                layout.copy_window(marks.grid(), place, window);
            }
            (Channel::SeenAgents, Some(marks), ..) => {
                layout.copy_window(marks.grid(), place, window);
                clear_beyond(sight, window);
            }
            (Channel::Goal, ..) => {
                window.fill(0.0);
                write_goal(cell, goal, window);
            }
            (Channel::CostToGo, .., Some(costs)) => {
                write_plain(layout, costs.of(agent), place, radius, window);
            }
            (Channel::CostTracer, .., Some(costs)) => {
                write_tracer(layout, costs.of(agent), place, &mut self.window, window);
            }
            (Channel::Path, .., Some(costs)) => {
                window.fill(0.0);
                draw_path(layout, shortest_path(layout, costs.of(agent), place), radius, window);
            }
            (Channel::FollowerPath, ..) => self.write_follower_path(agent, place, window),
            (Channel::SeenObstacles, ..) => {
                let at = offset(self.starts[agent], cell);
                self.memories[agent].copy_window(at, window);
            }
            // INVARIANT: `begin` prepares what the channels of the settings need.
            _ => window.fill(0.0),
        }
    }

    fn write_follower_path(&self, agent: usize, place: usize, window: &mut [f32]) {
        let Terrain { layout, obstacles, follower, .. } = &self.terrain;
        layout.copy_window(obstacles, place, window);
        for value in &mut *window {
            // Not `-*value`, which would be -0 for a free cell.
            *value = 0.0 - *value;
        }
        if let Some(follower) = follower {
            let cut = follower.cut(window.len().isqrt() / 2);
            draw_path(*layout, follower.path(agent, place), cut, window);
        }
    }

    fn write_scalars(&self, agent: usize, state: State<'_>, settings: &EncoderSettings, out: &mut [f32]) {
        let (start, cell, goal) = (self.starts[agent], state.cells[agent], state.goals[agent]);
        for (&known, out) in settings.scalars.iter().zip(out.chunks_exact_mut(Scalars::LEN)) {
            let values = if state.active[agent] { scalars(known, start, cell, goal) } else { [0.0; 2] };
            out.copy_from_slice(&values);
        }
    }
}

/// Sets the cells of a window beyond a distance from its centre to 0.
fn clear_beyond(distance: usize, window: &mut [f32]) {
    let side = window.len().isqrt();
    let is_beyond = |index: usize| index.abs_diff(side / 2) > distance;
    for (row, cells) in window.chunks_exact_mut(side).enumerate() {
        for (col, cell) in cells.iter_mut().enumerate() {
            if is_beyond(row) || is_beyond(col) {
                *cell = 0.0;
            }
        }
    }
}
