//! One environment and one step of it, as a table of contents.

use pogema_core::{Action, Cell, Config, Environment, Error, GoalStream, Instance, MapfOut, PomapfOut};
use pogema_core::{Snapshot, StepOut};

use crate::grid::{Grid, obstacles_with_border, place};

/// One environment that plays by POGEMA 1.4.0's rules.
#[derive(Clone, Debug)]
pub struct Reference {
    pub(crate) config: Config,
    pub(crate) obstacles: Grid,
    pub(crate) occupied: Grid,
    pub(crate) starts: Vec<Cell>,
    pub(crate) streams: Vec<GoalStream>,
    pub(crate) cells: Vec<Cell>,
    pub(crate) goals: Vec<Cell>,
    pub(crate) active: Vec<bool>,
    pub(crate) on_goal: Vec<bool>,
    pub(crate) step: u64,
    pub(crate) past: Vec<Snapshot>,
}

impl Reference {
    /// An environment for a config; it wants a reset first.
    ///
    /// # Errors
    /// If the config is out of range.
    pub fn new(config: Config) -> Result<Self, Error> {
        config.check()?;
        Ok(Self {
            config,
            obstacles: Grid::default(),
            occupied: Grid::default(),
            starts: Vec::new(),
            streams: Vec::new(),
            cells: Vec::new(),
            goals: Vec::new(),
            active: Vec::new(),
            on_goal: Vec::new(),
            step: 0,
            past: Vec::new(),
        })
    }

    pub(crate) fn check_started(&self) -> Result<(), Error> {
        if self.cells.is_empty() {
            return Err(Error::State { reason: "the environment was not reset yet".into() });
        }
        Ok(())
    }

    /// The indices of the agents that take part.
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
        self.starts = instance.starts().to_vec();
        self.streams = instance.goals().to_vec();
        self.cells = instance.starts().to_vec();
        self.goals = instance.first_goals();
        self.active = vec![true; self.config.num_agents];
        self.step = 0;
        self.mark_on_goal();
        self.past.clear();
        self.remember();
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
        self.remember();
        Ok(())
    }

    fn step_back(&mut self) -> Result<bool, Error> {
        self.check_started()?;
        self.take_back()
    }

    fn observe(&self, out: &mut [f32]) -> Result<(), Error> {
        self.check_started()?;
        self.write_default(out)
    }

    fn observe_pomapf(&self, out: PomapfOut<'_>) -> Result<(), Error> {
        self.check_started()?;
        self.write_pomapf(out)
    }

    fn observe_mapf(&self, out: MapfOut<'_>) -> Result<(), Error> {
        self.check_started()?;
        self.write_mapf(out)
    }

    fn snapshot(&self) -> Snapshot {
        Snapshot {
            step: self.step,
            cells: self.cells.clone(),
            goals: self.goals.clone(),
            active: self.active.clone(),
            on_goal: self.on_goal.clone(),
            occupied: self.occupied_cells(),
        }
    }
}

impl Reference {
    fn occupied_cells(&self) -> Vec<Cell> {
        let border = self.config.radius;
        let mut cells = Vec::new();
        for (row, flags) in self.occupied.rows().iter().enumerate() {
            for (col, _) in flags.iter().enumerate().filter(|&(_, &occupied)| occupied) {
                cells.push(Cell::new((row - border) as u16, (col - border) as u16));
            }
        }
        cells
    }
}
