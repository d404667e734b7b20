//! One environment and one step of it, as a table of contents.

use std::sync::Arc;

use pogema_core::{Action, Cell, Config, Environment, Error, GoalStream, Instance};
use pogema_core::{Seen, Snapshot, State, StepOut};
use rayon::ThreadPool;

use crate::grid::{Board, FREE, Strips, num_bytes};
use crate::simd::SimdPath;

/// One environment that plays by POGEMA 1.4.0's rules, on bits.
///
/// After a reset nothing is allocated.
#[derive(Debug)]
pub struct Engine {
    pub(crate) config: Config,
    pub(crate) path: SimdPath,
    pub(crate) pool: Option<Arc<ThreadPool>>,
    /// Of the map without its border; 0 before the first reset.
    pub(crate) height: usize,
    pub(crate) width: usize,
    pub(crate) obstacles: Strips,
    pub(crate) occupied: Strips,
    pub(crate) board: Board,
    pub(crate) streams: Vec<GoalStream>,
    pub(crate) cells: Vec<Cell>,
    pub(crate) goals: Vec<Cell>,
    pub(crate) active: Vec<bool>,
    pub(crate) on_goal: Vec<bool>,
    pub(crate) num_on_goal: usize,
    /// While a step is played: the place each agent aims at.
    pub(crate) targets: Vec<u32>,
    /// While a step is played: what stood at that place before.
    pub(crate) ahead: Vec<u32>,
    pub(crate) step: u64,
}

impl Engine {
    /// Most agents of one environment.
    pub const MOST_AGENTS: usize = FREE as usize - 1;

    /// An environment for a config; it wants a reset first.
    ///
    /// # Errors
    /// If the config is out of range, or `POGEMA_SIMD` names no path that this machine has.
    pub fn new(config: Config) -> Result<Self, Error> {
        Self::with_path(config, SimdPath::from_environment()?)
    }

    /// An environment that observes by a given path.
    ///
    /// # Errors
    /// If the config is out of range or this machine does not have the path.
    pub fn with_path(config: Config, path: SimdPath) -> Result<Self, Error> {
        config.check()?;
        path.check()?;
        if config.num_agents > Self::MOST_AGENTS {
            let expected = format!("at most {}", Self::MOST_AGENTS);
            return Err(Error::config("num_agents", config.num_agents, expected));
        }
        Ok(Self {
            config,
            path,
            pool: None,
            height: 0,
            width: 0,
            obstacles: Strips::default(),
            occupied: Strips::default(),
            board: Board::default(),
            streams: Vec::new(),
            cells: Vec::new(),
            goals: Vec::new(),
            active: Vec::new(),
            on_goal: Vec::new(),
            num_on_goal: 0,
            targets: Vec::new(),
            ahead: Vec::new(),
            step: 0,
        })
    }

    /// The same environment, its steps and observations spread over the threads of a pool. Worth it from about
    /// ten thousand agents on; what comes out is the same.
    #[must_use]
    pub fn with_pool(mut self, pool: Arc<ThreadPool>) -> Self {
        self.pool = Some(pool);
        self
    }

    /// Begins an episode, taking the instance's goals over instead of copying them.
    ///
    /// # Errors
    /// If the instance does not fit the config, or memory does not suffice.
    pub fn start(&mut self, instance: Instance) -> Result<(), Error> {
        instance.check_fits(&self.config)?;
        self.fit(instance.map().height(), instance.map().width())?;
        self.lay_out(&instance);
        self.streams = instance.into_goals();
        Ok(())
    }

    /// The size of the map, as rows and columns, without its border; 0 before the first reset.
    pub fn size(&self) -> (usize, usize) {
        (self.height, self.width)
    }

    /// Where each agent is; a finished agent stays where it finished.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// Where each agent wants to go now.
    pub fn goals(&self) -> &[Cell] {
        &self.goals
    }

    /// The goals of each agent that are still to come.
    pub fn streams(&self) -> &[GoalStream] {
        &self.streams
    }

    /// Which agents still take part.
    pub fn active(&self) -> &[bool] {
        &self.active
    }

    /// Steps since the reset, less those taken back.
    pub fn num_steps(&self) -> u64 {
        self.step
    }

    /// Bytes that the environment holds, apart from what its goal streams hold behind pointers.
    pub fn num_bytes(&self) -> usize {
        let lists = [
            self.obstacles.num_bytes(),
            self.occupied.num_bytes(),
            self.board.num_bytes(),
            num_bytes(&self.cells),
            num_bytes(&self.goals),
            num_bytes(&self.streams),
            num_bytes(&self.active),
            num_bytes(&self.on_goal),
            num_bytes(&self.targets),
            num_bytes(&self.ahead),
        ];
        size_of::<Self>() + lists.iter().sum::<usize>()
    }

    pub(crate) fn check_started(&self) -> Result<(), Error> {
        if self.cells.is_empty() { Err(Error::NotReset) } else { Ok(()) }
    }

    /// Makes room for a map of a size; the only place where memory is asked for.
    fn fit(&mut self, height: usize, width: usize) -> Result<(), Error> {
        if (height, width) == (self.height, self.width) {
            return Ok(());
        }
        let border = 2 * self.config.radius;
        let obstacles = Strips::empty(height + border, width + border)?;
        let occupied = Strips::empty(height + border, width + border)?;
        self.board = Board::walls(height, width)?;
        (self.obstacles, self.occupied) = (obstacles, occupied);
        (self.height, self.width) = (height, width);
        let num_agents = self.config.num_agents;
        self.targets = vec![0; num_agents];
        self.ahead = vec![0; num_agents];
        Ok(())
    }

    /// Rule: goal/finish/start-on-goal, occupancy/as-released, occupancy/exact
    fn lay_out(&mut self, instance: &Instance) {
        let num_agents = self.config.num_agents;
        self.obstacles.write_obstacles(instance, self.config.radius);
        self.board.write_obstacles(instance.map().obstacles());
        self.cells.clear();
        self.cells.extend_from_slice(instance.starts());
        self.goals.clear();
        self.goals.extend(instance.goals().iter().map(GoalStream::first));
        self.active.clear();
        self.active.resize(num_agents, true);
        self.on_goal.clear();
        self.on_goal.resize(num_agents, false);
        self.step = 0;
        self.occupied.clear_all();
        self.take_squares();
        for &start in instance.starts() {
            self.mark(start);
        }
        self.mark_on_goal();
    }
}

impl Environment for Engine {
    fn config(&self) -> &Config {
        &self.config
    }

    fn reset(&mut self, instance: &Instance) -> Result<(), Error> {
        instance.check_fits(&self.config)?;
        self.fit(instance.map().height(), instance.map().width())?;
        self.lay_out(instance);
        self.streams.clear();
        self.streams.extend_from_slice(instance.goals());
        Ok(())
    }

    fn step(&mut self, actions: &[Action], out: StepOut<'_>) -> Result<(), Error> {
        self.check_started()?;
        Error::check_length("actions", self.config.num_agents, actions.len())?;
        out.check(self.config.num_agents)?;
        self.step += 1;
        self.move_agents(actions);
        self.mark_on_goal();
        self.pay(out.rewards);
        self.terminate(out.terminated);
        self.truncate(out.truncated);
        self.change_goals();
        Ok(())
    }

    fn restore(&mut self, step: u64, state: &Snapshot) -> Result<(), Error> {
        self.check_started()?;
        self.return_to(step, state)
    }

    fn state(&self) -> State<'_> {
        let Self { step, cells, goals, active, on_goal, .. } = self;
        State { step: *step, cells, goals, active, on_goal }
    }

    fn occupied(&self) -> Vec<Cell> {
        let radius = self.config.radius;
        let rows = 0..self.height as u16;
        let cells = rows.flat_map(|row| (0..self.width as u16).map(move |col| Cell::new(row, col)));
        cells
            .filter(|cell| self.occupied.get(usize::from(cell.row) + radius, usize::from(cell.col) + radius))
            .collect()
    }

    fn observe(&self, out: &mut [f32]) -> Result<(), Error> {
        self.observe_agents(0..self.config.num_agents, out)
    }

    fn observe_map(&self, out: &mut [u8]) -> Result<(), Error> {
        self.check_started()?;
        self.write_map(out)
    }

    fn count_seen(&self, seen: &mut Vec<Seen>) -> Result<(), Error> {
        self.check_started()?;
        self.count_in_windows(seen);
        Ok(())
    }
}

impl Engine {
    /// Marks a cell as occupied.
    pub(crate) fn mark(&self, cell: Cell) {
        let radius = self.config.radius;
        self.occupied.set(usize::from(cell.row) + radius, usize::from(cell.col) + radius, false);
    }
}
