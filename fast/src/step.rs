//! The fast engine, with the order of the phases in a step.

use std::sync::Arc;

use pogema_core::{Action, Cell, Config, Environment, Error, GoalStream, Instance};
use pogema_core::{Seen, SimdPath, Snapshot, State, StepOut};
use rayon::ThreadPool;

use crate::grid::{Board, FREE, Strips, num_bytes};

/// The fast engine: one environment with the rules of POGEMA 1.4.0, on bit sets.
///
/// Without a thread pool, steps and observations allocate no memory.
#[derive(Debug)]
pub struct Engine {
    pub(crate) config: Config,
    pub(crate) path: SimdPath,
    pub(crate) pool: Option<Arc<ThreadPool>>,
    /// Height of the map without its border; 0 before the first reset.
    pub(crate) height: usize,
    pub(crate) width: usize,
    pub(crate) obstacles: Strips,
    pub(crate) occupied: Strips,
    pub(crate) board: Board,
    pub(crate) streams: Vec<GoalStream>,
    pub(crate) starts: Vec<Cell>,
    pub(crate) cells: Vec<Cell>,
    pub(crate) goals: Vec<Cell>,
    pub(crate) active: Vec<bool>,
    pub(crate) on_goal: Vec<bool>,
    pub(crate) num_on_goal: usize,
    /// While a step is played: the square that each agent requests.
    pub(crate) targets: Vec<u32>,
    /// While a step is played: the content of that square before the step.
    pub(crate) ahead: Vec<u32>,
    pub(crate) step: u64,
}

impl Engine {
    /// Largest number of agents of one environment.
    pub const MAX_AGENTS: usize = FREE as usize - 1;

    /// Creates an environment for a config. Call `reset` or `start` before `step`.
    ///
    /// # Errors
    /// If the config is out of range, or `POGEMA_SIMD` is not the name of a path that this machine supports.
    pub fn new(config: Config) -> Result<Self, Error> {
        Self::with_path(config, SimdPath::from_environment()?)
    }

    /// Creates an environment that computes observations with a given SIMD path.
    ///
    /// # Errors
    /// If the config is out of range or this machine does not support the path.
    pub fn with_path(config: Config, path: SimdPath) -> Result<Self, Error> {
        config.check()?;
        path.check()?;
        if config.num_agents > Self::MAX_AGENTS {
            let expected = format!("at most {}", Self::MAX_AGENTS);
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
            starts: Vec::new(),
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

    /// Spreads steps and observations over the threads of a pool.
    ///
    /// The results are the same. A pool pays off from about ten thousand agents on.
    #[must_use]
    pub fn with_pool(mut self, pool: Arc<ThreadPool>) -> Self {
        self.pool = Some(pool);
        self
    }

    /// Begins an episode like `reset`, but moves the instance's goals instead of copying them.
    ///
    /// # Errors
    /// If the instance does not fit the config, or there is not enough memory.
    pub fn start(&mut self, instance: Instance) -> Result<(), Error> {
        instance.check_fits(&self.config)?;
        self.start_resized(&mut Some(instance))
    }

    /// Takes an instance, if there is one, and begins its episode. The engine's config adopts the number of agents
    /// of the instance.
    ///
    /// In all other respects, the instance must fit the config. If there is not enough memory, the caller keeps the
    /// instance.
    pub(crate) fn start_resized(&mut self, next: &mut Option<Instance>) -> Result<(), Error> {
        let Some(instance) = next else { return Ok(()) };
        self.resize(instance.map().height(), instance.map().width())?;
        self.config.num_agents = instance.starts().len();
        self.load(instance);
        self.streams = next.take().map(Instance::into_goals).unwrap_or_default();
        Ok(())
    }

    /// Returns the numbers of rows and columns of the map without its border; both are 0 before the first reset.
    pub fn size(&self) -> (usize, usize) {
        (self.height, self.width)
    }

    /// Returns the cell on which each agent began the episode.
    pub fn starts(&self) -> &[Cell] {
        &self.starts
    }

    /// Returns the cell of each agent; a finished agent stays where it finished.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// Returns the current goal of each agent.
    pub fn goals(&self) -> &[Cell] {
        &self.goals
    }

    /// Returns the goal stream of each agent.
    pub fn streams(&self) -> &[GoalStream] {
        &self.streams
    }

    /// Returns which agents are still active.
    pub fn active(&self) -> &[bool] {
        &self.active
    }

    /// Returns the number of steps since the reset, undone steps excluded.
    pub fn num_steps(&self) -> u64 {
        self.step
    }

    /// Returns the number of bytes that the environment uses, except data that goal streams hold behind pointers.
    pub fn num_bytes(&self) -> usize {
        let lists = [
            self.obstacles.num_bytes(),
            self.occupied.num_bytes(),
            self.board.num_bytes(),
            num_bytes(&self.starts),
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

    /// Allocates memory for a map of a given size. No other function allocates memory for the map.
    fn resize(&mut self, height: usize, width: usize) -> Result<(), Error> {
        if (height, width) == (self.height, self.width) {
            return Ok(());
        }
        let border = 2 * self.config.radius;
        let obstacles = Strips::empty(height + border, width + border)?;
        let occupied = Strips::empty(height + border, width + border)?;
        self.board = Board::walls(height, width)?;
        (self.obstacles, self.occupied) = (obstacles, occupied);
        (self.height, self.width) = (height, width);
        Ok(())
    }

    /// Writes the state after a reset, except the goal streams.
    ///
    /// Rule: goal/finish/start-on-goal, occupancy/as-released, occupancy/exact
    fn load(&mut self, instance: &Instance) {
        let num_agents = self.config.num_agents;
        self.obstacles.write_obstacles(instance, self.config.radius);
        self.board.write_obstacles(instance.map().obstacles());
        for list in [&mut self.starts, &mut self.cells] {
            list.clear();
            list.extend_from_slice(instance.starts());
        }
        self.goals.clear();
        self.goals.extend(instance.goals().iter().map(GoalStream::first));
        self.active.clear();
        self.active.resize(num_agents, true);
        self.on_goal.clear();
        self.on_goal.resize(num_agents, false);
        for list in [&mut self.targets, &mut self.ahead] {
            list.resize(num_agents, 0);
        }
        self.step = 0;
        self.occupied.clear_all();
        self.place_agents();
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
        self.resize(instance.map().height(), instance.map().width())?;
        self.load(instance);
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
        self.occupied.set_if(true, usize::from(cell.row) + radius, usize::from(cell.col) + radius, false);
    }
}
