//! Encoders: what a policy sees, as data.
//!
//! An [`Encoder`] turns the states of one environment into windows and numbers of its agents. It needs no engine: it
//! reads a map and the [`State`] after each step, so an episode, a lane of a batch and a replay all give the same bytes.

pub(crate) mod costs;
pub(crate) mod layout;
mod marks;
mod memory;
mod offsets;
mod path;
mod settings;
mod words;

use pogema_core::{Cell, Error, Map, Occupancy, Outside, State};

use costs::{Costs, write_plain, write_tracer};
use layout::Layout;
use marks::Marks;
use memory::Memory;
use offsets::{feature, offset, write_goal};
use path::{draw_path, shortest_path};
pub use settings::EncoderSettings;
pub use words::{Channel, Feature};

/// An encoder for one environment.
///
/// [`Encoder::begin`] starts an episode. [`Encoder::encode`] is then called once for the state after the reset and once
/// after each step, because some channels remember earlier states. Encoding takes no random numbers and no threads.
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
    episode: Option<Episode>,
}

/// The memory of an episode.
#[derive(Debug)]
struct Episode {
    layout: Layout,
    starts: Vec<Cell>,
    obstacles: Vec<f32>,
    marks: Option<Marks>,
    all: Option<Marks>,
    costs: Option<Costs>,
    memories: Vec<Memory>,
}

impl Encoder {
    /// Creates an encoder.
    ///
    /// # Errors
    /// [`Error::Config`] naming the first setting that is out of range.
    pub fn new(settings: EncoderSettings) -> Result<Self, Error> {
        settings.check()?;
        Ok(Self { settings, episode: None })
    }

    /// Returns the settings.
    pub fn settings(&self) -> &EncoderSettings {
        &self.settings
    }

    /// Starts an episode: forgets the last one, and prepares the map.
    ///
    /// `starts` holds the cell of each agent after the reset. For [`Outside::Noise`], an engine's map with its border
    /// is suitable, too: the encoder draws the wall and reads only the cells beyond it.
    pub fn begin(&mut self, map: &Map, outside: &Outside, occupancy: Occupancy, starts: &[Cell]) {
        let has = |channels: &[Channel]| self.settings.channels.iter().any(|known| channels.contains(known));
        let layout = Layout::new(map, self.settings.radius.max(self.settings.sight));
        let remembers = has(&[Channel::SeenObstacles]);
        let needs_costs = has(&[Channel::CostToGo, Channel::CostTracer, Channel::Path]);
        self.episode = Some(Episode {
            layout,
            starts: starts.to_vec(),
            obstacles: layout.obstacles(map, outside),
            marks: has(&[Channel::Agents]).then(|| Marks::new(layout, occupancy)),
            all: has(&[Channel::AllAgents]).then(|| Marks::new(layout, Occupancy::Exact)),
            costs: needs_costs.then(|| Costs::new(layout, map)),
            memories: if remembers { vec![Memory::new(); starts.len()] } else { Vec::new() },
        });
    }

    /// Writes the windows and the numbers of all agents; those of an inactive agent are 0.
    ///
    /// Shape: `windows` is `[agents, channels, side, side]`, `features` is `[agents, features, 2]`.
    ///
    /// # Errors
    /// [`Error::NotReset`] before [`Encoder::begin`]; [`Error::Length`] for a buffer or a list of the wrong length;
    /// [`Error::Agent`] for a cell or a goal outside the map. No memory changes then.
    pub fn encode(
        &mut self,
        state: State<'_>,
        windows: &mut [f32],
        features: &mut [f32],
    ) -> Result<(), Error> {
        let Self { settings, episode } = self;
        let episode = episode.as_mut().ok_or(Error::NotReset)?;
        let num_agents = episode.starts.len();
        Error::check_length("cells", num_agents, state.cells.len())?;
        Error::check_length("goals", num_agents, state.goals.len())?;
        Error::check_length("active", num_agents, state.active.len())?;
        Error::check_length("windows", num_agents * settings.window_len(), windows.len())?;
        Error::check_length("features", num_agents * settings.features_len(), features.len())?;
        episode.layout.check_inside("cell", state.cells)?;
        episode.layout.check_inside("goal", state.goals)?;
        episode.follow(state, settings);
        if settings.window_len() > 0 {
            for (agent, out) in windows.chunks_exact_mut(settings.window_len()).enumerate() {
                episode.write_windows(agent, state, settings, out);
            }
        }
        if settings.features_len() > 0 {
            for (agent, out) in features.chunks_exact_mut(settings.features_len()).enumerate() {
                episode.write_features(agent, state, settings, out);
            }
        }
        Ok(())
    }
}

impl Episode {
    fn follow(&mut self, state: State<'_>, settings: &EncoderSettings) {
        for marks in self.marks.iter_mut().chain(&mut self.all) {
            marks.follow(state);
        }
        if let Some(costs) = &mut self.costs {
            costs.follow(state);
        }
        for (agent, memory) in self.memories.iter_mut().enumerate().filter(|(agent, _)| state.active[*agent])
        {
            let cell = state.cells[agent];
            let at = offset(self.starts[agent], cell);
            memory.see(self.layout, &self.obstacles, self.layout.place(cell), at, settings.sight);
        }
    }

    fn write_windows(&mut self, agent: usize, state: State<'_>, settings: &EncoderSettings, out: &mut [f32]) {
        if !state.active[agent] {
            return out.fill(0.0);
        }
        let area = settings.side() * settings.side();
        for (&channel, window) in settings.channels.iter().zip(out.chunks_exact_mut(area)) {
            self.write_window(channel, agent, state, window);
        }
    }

    fn write_window(&mut self, channel: Channel, agent: usize, state: State<'_>, window: &mut [f32]) {
        let (cell, goal, layout) = (state.cells[agent], state.goals[agent], self.layout);
        let place = layout.place(cell);
        match (channel, &self.marks, &self.all, &self.costs) {
            (Channel::Obstacles, ..) => layout.copy_window(&self.obstacles, place, window),
            (Channel::Agents, Some(marks), ..) | (Channel::AllAgents, _, Some(marks), _) => {
                layout.copy_window(marks.grid(), place, window);
            }
            (Channel::Goal, ..) => {
                window.fill(0.0);
                write_goal(cell, goal, window);
            }
            (Channel::CostToGo, .., Some(costs)) => write_plain(layout, costs.of(agent), place, window),
            (Channel::CostTracer, .., Some(costs)) => write_tracer(layout, costs.of(agent), place, window),
            (Channel::Path, .., Some(costs)) => {
                window.fill(0.0);
                let radius = window.len().isqrt() / 2;
                draw_path(layout, shortest_path(layout, costs.of(agent), place), radius, window);
            }
            (Channel::SeenObstacles, ..) => {
                let at = offset(self.starts[agent], cell);
                self.memories[agent].copy_window(at, window);
            }
            // INVARIANT: `begin` prepares what the channels of the settings need.
            _ => window.fill(0.0),
        }
    }

    fn write_features(&self, agent: usize, state: State<'_>, settings: &EncoderSettings, out: &mut [f32]) {
        let (start, cell, goal) = (self.starts[agent], state.cells[agent], state.goals[agent]);
        for (&known, out) in settings.features.iter().zip(out.chunks_exact_mut(Feature::LEN)) {
            let values = if state.active[agent] { feature(known, start, cell, goal) } else { [0.0; 2] };
            out.copy_from_slice(&values);
        }
    }
}
