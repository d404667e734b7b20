//! A second engine that follows POGEMA's own procedures step for step.
//!
//! The reference defines which agents may move, independently of any order. This engine instead runs the original
//! procedures with their lists, edges and reverts. The two were written independently and must agree on every step.

mod moves;

use pogema_core::{
    Action, Cell, Collision, Config, Environment, Error, GoalStream, Instance, Occupancy, OnGoal, Outside,
    Reward, Snapshot, State, StepOut,
};

/// A cell of the map with its border, counted from the corner of the border.
type Place = (usize, usize);

/// One environment that follows the procedures of POGEMA 1.4.0.
#[derive(Clone, Debug, Default)]
pub struct Literal {
    config: Config,
    obstacles: Vec<Vec<u8>>,
    positions: Vec<Vec<u8>>,
    places: Vec<Place>,
    goals: Vec<Place>,
    /// The same places and goals without the border, as the public API reports them.
    cells: Vec<Cell>,
    goal_cells: Vec<Cell>,
    active: Vec<bool>,
    was_on_goal: Vec<bool>,
    streams: Vec<GoalStream>,
    elapsed: u64,
}

impl Literal {
    /// Creates an environment for a config. Call `reset` before `step`.
    ///
    /// # Errors
    /// If a field of the config is out of range.
    pub fn new(config: Config) -> Result<Self, Error> {
        config.check()?;
        Ok(Self { config, ..Self::default() })
    }

    fn check_reset(&self) -> Result<(), Error> {
        if self.obstacles.is_empty() { Err(Error::NotReset) } else { Ok(()) }
    }

    fn pad(&self, cell: Cell) -> Place {
        (usize::from(cell.row) + self.config.radius, usize::from(cell.col) + self.config.radius)
    }

    fn unpad(&self, (row, col): Place) -> Cell {
        Cell::new((row - self.config.radius) as u16, (col - self.config.radius) as u16)
    }

    fn update_cells(&mut self) {
        self.cells = self.places.iter().map(|&place| self.unpad(place)).collect();
        self.goal_cells = self.goals.iter().map(|&place| self.unpad(place)).collect();
    }

    fn update_on_goal(&mut self) {
        let on_goal = |agent: usize| self.places[agent] == self.goals[agent] && self.active[agent];
        self.was_on_goal = (0..self.places.len()).map(on_goal).collect();
    }

    fn window(&self, grid: &[Vec<u8>], agent: usize) -> impl Iterator<Item = f32> {
        let (row, col) = self.places[agent];
        let radius = self.config.radius;
        let rows = grid[row - radius..=row + radius].to_vec();
        rows.into_iter().flat_map(move |line| line[col - radius..=col + radius].to_vec()).map(f32::from)
    }
}

impl Environment for Literal {
    fn config(&self) -> &Config {
        &self.config
    }

    fn reset(&mut self, instance: &Instance) -> Result<(), Error> {
        instance.check_fits(&self.config)?;
        let radius = self.config.radius;
        let (height, width) = (instance.map().height() + 2 * radius, instance.map().width() + 2 * radius);
        let mut obstacles = match instance.outside() {
            Outside::Free => vec![vec![0; width]; height],
            Outside::Noise(noise) => noise
                .obstacles()
                .chunks(width)
                .map(|row| row.iter().map(|&flag| u8::from(flag)).collect())
                .collect(),
        };
        obstacles[radius - 1][radius - 1..=width - radius].fill(1);
        obstacles[height - radius][radius - 1..=width - radius].fill(1);
        for row in &mut obstacles[radius - 1..=height - radius] {
            row[radius - 1] = 1;
            row[width - radius] = 1;
        }
        for (row, flags) in instance.map().obstacles().chunks(instance.map().width()).enumerate() {
            for (col, &flag) in flags.iter().enumerate() {
                obstacles[row + radius][col + radius] = u8::from(flag);
            }
        }
        self.obstacles = obstacles;
        self.positions = vec![vec![0; width]; height];
        self.places = instance.starts().iter().map(|&cell| self.pad(cell)).collect();
        for &(row, col) in &self.places {
            self.positions[row][col] = 1;
        }
        self.goals = instance.first_goals().into_iter().map(|cell| self.pad(cell)).collect();
        self.streams = instance.goals().to_vec();
        self.active = vec![true; self.config.num_agents];
        self.elapsed = 0;
        self.update_on_goal();
        self.update_cells();
        Ok(())
    }

    fn step(&mut self, actions: &[Action], out: StepOut<'_>) -> Result<(), Error> {
        self.check_reset()?;
        Error::check_length("actions", self.config.num_agents, actions.len())?;
        out.check(self.config.num_agents)?;
        match self.config.collision {
            Collision::Priority => self.move_by_priority(actions),
            Collision::BlockBoth => self.move_blocking_both(actions),
            Collision::Soft => self.move_softly(actions),
        }
        if self.config.occupancy == Occupancy::Exact {
            self.positions.iter_mut().for_each(|row| row.fill(0));
            for agent in self.active_agents() {
                let (row, col) = self.places[agent];
                self.positions[row][col] = 1;
            }
        }
        self.update_on_goal();
        let solved = self.was_on_goal.iter().all(|&reached| reached);
        let share = self.was_on_goal.iter().filter(|&&reached| reached).count() as f32 / actions.len() as f32;
        for agent in 0..actions.len() {
            let on_goal = self.places[agent] == self.goals[agent];
            let (reward, ended) = match self.config.on_goal {
                OnGoal::Finish => (self.was_on_goal[agent], on_goal),
                OnGoal::Nothing => (solved, solved),
                OnGoal::Restart => (on_goal, false),
            };
            let own = if reward { 1.0 } else { 0.0 };
            out.rewards[agent] = if self.config.reward == Reward::Shared { share } else { own };
            out.terminated[agent] = ended;
            if on_goal && self.config.on_goal == OnGoal::Restart {
                let cell = self.unpad(self.places[agent]);
                let next = self.streams[agent].advance(cell);
                self.goals[agent] = self.pad(next);
            }
        }
        for agent in 0..actions.len() {
            if self.config.on_goal == OnGoal::Finish && self.was_on_goal[agent] {
                let (row, col) = self.places[agent];
                self.positions[row][col] = 0;
                self.active[agent] = false;
            }
        }
        self.elapsed += 1;
        out.truncated.fill(self.elapsed as i64 >= self.config.max_steps);
        self.update_cells();
        Ok(())
    }

    fn restore(&mut self, step: u64, state: &Snapshot) -> Result<(), Error> {
        let border = 2 * self.config.radius;
        self.check_reset()?;
        let (height, width) = (self.obstacles.len(), self.obstacles.first().map_or(0, Vec::len));
        state.check_fits(self.config.num_agents, (height - border, width - border))?;
        self.places = state.cells.iter().map(|&cell| self.pad(cell)).collect();
        self.goals = state.goals.iter().map(|&cell| self.pad(cell)).collect();
        self.active.clone_from(&state.active);
        self.elapsed = step;
        self.positions.iter_mut().for_each(|row| row.fill(0));
        for (row, col) in state.occupied.iter().map(|&cell| self.pad(cell)).collect::<Vec<_>>() {
            self.positions[row][col] = 1;
        }
        self.update_cells();
        Ok(())
    }

    fn state(&self) -> State<'_> {
        let Self { elapsed, cells, goal_cells: goals, active, was_on_goal: on_goal, .. } = self;
        State { step: *elapsed, cells, goals, active, on_goal }
    }

    fn occupied(&self) -> Vec<Cell> {
        let mut occupied = Vec::new();
        for (row, flags) in self.positions.iter().enumerate() {
            let marked = flags.iter().enumerate().filter(|&(_, &flag)| flag == 1);
            occupied.extend(marked.map(|(col, _)| self.unpad((row, col))));
        }
        occupied
    }

    fn observe(&self, out: &mut [f32]) -> Result<(), Error> {
        self.check_reset()?;
        let (side, radius) = (self.config.side(), self.config.radius as i64);
        Error::check_length("observations", self.config.num_agents * 3 * side * side, out.len())?;
        for (agent, channels) in out.chunks_mut(3 * side * side).enumerate() {
            let clamped =
                |own: usize, goal: usize| (goal as i64 - own as i64).clamp(-radius, radius) + radius;
            let (place, goal) = (self.places[agent], self.goals[agent]);
            let at = clamped(place.0, goal.0) as usize * side + clamped(place.1, goal.1) as usize;
            let goal_window = (0..side * side).map(|index| if index == at { 1.0 } else { 0.0 });
            let windows = self.window(&self.obstacles, agent).chain(self.window(&self.positions, agent));
            channels.iter_mut().zip(windows.chain(goal_window)).for_each(|(value, seen)| *value = seen);
        }
        Ok(())
    }

    fn observe_map(&self, out: &mut [u8]) -> Result<(), Error> {
        self.check_reset()?;
        let num_cells = self.obstacles.iter().map(Vec::len).sum();
        Error::check_length("map", num_cells, out.len())?;
        let values = self.obstacles.iter().flatten();
        out.iter_mut().zip(values).for_each(|(value, &flag)| *value = flag);
        Ok(())
    }
}
