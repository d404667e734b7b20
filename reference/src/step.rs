//! The reference engine, with the order of the phases in a step.

use pogema_core::{Action, Cell, Config, Environment, Error, GoalStream, Instance};
use pogema_core::{Snapshot, State, StepOut};

use crate::grid::{Grid, obstacles_with_border, place};

/// The reference engine: one environment with the rules of POGEMA 1.4.0.
#[derive(Clone, Debug)]
pub struct Reference {
    pub(crate) config: Config,
    pub(crate) obstacles: Grid,
    pub(crate) occupied: Grid,
    pub(crate) streams: Vec<GoalStream>,
    pub(crate) cells: Vec<Cell>,
    pub(crate) goals: Vec<Cell>,
    pub(crate) active: Vec<bool>,
    pub(crate) on_goal: Vec<bool>,
    pub(crate) step: u64,
}

impl Reference {
    /// Creates an environment for a config. Call `reset` before `step`.
    ///
    /// # Errors
    /// If the config is out of range.
    pub fn new(config: Config) -> Result<Self, Error> {
        config.check()?;
        Ok(Self {
            config,
            obstacles: Grid::default(),
            occupied: Grid::default(),
            streams: Vec::new(),
            cells: Vec::new(),
            goals: Vec::new(),
            active: Vec::new(),
            on_goal: Vec::new(),
            step: 0,
        })
    }

    pub(crate) fn check_started(&self) -> Result<(), Error> {
        if self.cells.is_empty() { Err(Error::NotReset) } else { Ok(()) }
    }

    /// Returns the indices of the active agents.
    ///
    /// Rule: move/inactive
    pub(crate) fn active_agents(&self) -> Vec<usize> {
        (0..self.active.len()).filter(|&agent| self.active[agent]).collect()
    }
}

impl Environment for Reference {
    fn config(&self) -> &Config {
        &self.config
    }

    /// Rule: goal/finish/start-on-goal, occupancy/as-released, occupancy/exact
    fn reset(&mut self, instance: &Instance) -> Result<(), Error> {
        instance.check_fits(&self.config)?;
        let map = instance.map();
        self.obstacles = obstacles_with_border(instance, self.config.radius);
        self.occupied = Grid::empty(map.height(), map.width(), self.config.radius);
        for &start in instance.starts() {
            self.occupied.set(place(start), true);
        }
        self.streams = instance.goals().to_vec();
        self.cells = instance.starts().to_vec();
        self.goals = instance.first_goals();
        self.active = vec![true; self.config.num_agents];
        self.step = 0;
        self.mark_on_goal();
        Ok(())
    }

    /// Source: POGEMA 1.4.0, `envs.py`, `Pogema.step`, `PogemaLifeLong.step`, `PogemaCoopFinish.step`
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
        let (rows, border) = (self.obstacles.rows(), 2 * self.config.radius);
        state.check_fits(self.config.num_agents, (rows.len() - border, rows[0].len() - border))?;
        self.return_to(step, state);
        Ok(())
    }

    fn state(&self) -> State<'_> {
        let Self { step, cells, goals, active, on_goal, .. } = self;
        State { step: *step, cells, goals, active, on_goal }
    }

    fn occupied(&self) -> Vec<Cell> {
        let border = self.config.radius;
        let mut cells = Vec::new();
        for (row, flags) in self.occupied.rows().iter().enumerate() {
            for (col, _) in flags.iter().enumerate().filter(|&(_, &occupied)| occupied) {
                cells.push(Cell::new((row - border) as u16, (col - border) as u16));
            }
        }
        cells
    }

    fn observe(&self, out: &mut [f32]) -> Result<(), Error> {
        self.check_started()?;
        self.write_default(out)
    }

    fn observe_map(&self, out: &mut [u8]) -> Result<(), Error> {
        self.check_started()?;
        self.write_map(out)
    }
}
