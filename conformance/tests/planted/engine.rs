//! A plain environment that is right, but for one planted bug.

use std::collections::HashSet;

use pogema_core::{
    Action, Cell, Config, Environment, Error, GoalStream, Instance, Map, Occupancy, OnGoal, Outside, Reward,
    Snapshot, State, StepOut,
};

use crate::flaw::Flaw;

pub type Place = (i32, i32);

pub struct Flawed {
    pub flaw: Flaw,
    pub config: Config,
    pub instance: Instance,
    pub cells: Vec<Place>,
    goals: Vec<Place>,
    streams: Vec<GoalStream>,
    pub active: Vec<bool>,
    on_goal: Vec<bool>,
    pub occupied: HashSet<Place>,
    elapsed: i64,
    /// Cells and goals as others see them.
    seen: [Vec<Cell>; 2],
}

pub fn place(cell: Cell) -> Place {
    (i32::from(cell.row), i32::from(cell.col))
}

fn cell((row, col): Place) -> Cell {
    Cell::new(row as u16, col as u16)
}

impl Flawed {
    pub fn make(flaw: Flaw, config: Config) -> Result<Box<dyn Environment>, Error> {
        config.check()?;
        let nothing = Map::new(1, 1, vec![false])?;
        Ok(Box::new(Self {
            flaw,
            config,
            instance: Instance::new(nothing, Outside::Free, Vec::new(), Vec::new())?,
            cells: Vec::new(),
            goals: Vec::new(),
            streams: Vec::new(),
            active: Vec::new(),
            on_goal: Vec::new(),
            occupied: HashSet::new(),
            elapsed: 0,
            seen: [Vec::new(), Vec::new()],
        }))
    }

    pub fn has(&self, flaw: Flaw) -> bool {
        self.flaw == flaw
    }

    pub fn active_agents(&self) -> Vec<usize> {
        let moves = |&agent: &usize| self.active[agent] || self.has(Flaw::FinishedMove);
        (0..self.cells.len()).filter(moves).collect()
    }

    /// Where nobody can go.
    pub fn is_blocked(&self, place: Place) -> bool {
        let map = self.instance.map();
        match (u16::try_from(place.0), u16::try_from(place.1)) {
            (Ok(row), Ok(col)) if map.contains(Cell::new(row, col)) => map.is_obstacle(Cell::new(row, col)),
            _ => !self.has(Flaw::MapHasNoWall),
        }
    }

    /// What is seen at a place, which may lie off the map.
    fn looks_blocked(&self, (row, col): Place) -> bool {
        let map = self.instance.map();
        let (height, width) = (map.height() as i32, map.width() as i32);
        if (0..height).contains(&row) && (0..width).contains(&col) {
            return map.is_obstacle(Cell::new(row as u16, col as u16));
        }
        let is_ring = (-1..=height).contains(&row) && (-1..=width).contains(&col);
        if is_ring && !self.has(Flaw::NoRing) || self.has(Flaw::OutsideFilled) {
            return true;
        }
        let radius = self.config.radius as i32;
        match self.instance.outside() {
            Outside::Free => false,
            Outside::Noise(noise) => {
                noise.is_obstacle(Cell::new((row + radius) as u16, (col + radius) as u16))
            }
        }
    }

    pub fn target(&self, agent: usize, actions: &[Action]) -> Place {
        let (row, col) = self.cells[agent];
        let (down, right) = actions[agent].delta();
        match self.flaw {
            Flaw::UpIsDown => (row - down, col + right),
            Flaw::RowsAreColumns => (row + right, col + down),
            _ => (row + down, col + right),
        }
    }

    /// Moves an agent and its mark; one that comes later wipes out the mark of one that came before.
    pub fn put(&mut self, agent: usize, target: Place) {
        self.occupied.remove(&self.cells[agent]);
        self.occupied.insert(target);
        self.cells[agent] = target;
    }

    /// Gives every active agent its mark back.
    pub fn mark_all(&mut self) {
        let active = (0..self.cells.len()).filter(|&agent| self.active[agent]);
        let marked: Vec<Place> = active.map(|agent| self.cells[agent]).collect();
        self.occupied.extend(marked);
    }

    fn pay_and_end(&mut self, out: &mut StepOut<'_>) {
        let all = self.on_goal.iter().all(|&reached| reached);
        let reached = self.on_goal.iter().filter(|&&reached| reached).count();
        let shared = reached as f32 / self.on_goal.len() as f32;
        let max_steps = match self.flaw {
            Flaw::CutOffOneLate => self.config.max_steps.max(1).saturating_add(1),
            Flaw::CutOffOneEarly => self.config.max_steps.saturating_sub(1),
            Flaw::NeverCutOffAtZero if self.config.max_steps <= 0 => i64::MAX,
            _ => self.config.max_steps,
        };
        for agent in 0..self.cells.len() {
            let is_there = self.cells[agent] == self.goals[agent];
            let (pays, ends) = match self.config.on_goal {
                OnGoal::Finish if self.has(Flaw::RewardEveryStepOnGoal) => (is_there, is_there),
                OnGoal::Finish if self.has(Flaw::FinishEndsForOneStep) => {
                    (self.on_goal[agent], self.on_goal[agent])
                }
                OnGoal::Finish => (self.on_goal[agent], is_there),
                OnGoal::Nothing => (
                    all || self.has(Flaw::NothingRewardsEachAlone) && is_there,
                    all || self.has(Flaw::NothingEndsEachAlone) && is_there,
                ),
                OnGoal::Restart => (self.on_goal[agent], self.has(Flaw::RestartEndsOnGoal) && is_there),
            };
            out.rewards[agent] = match self.config.reward {
                Reward::Shared => shared,
                Reward::Own => f32::from(u8::from(pays)),
            };
            out.terminated[agent] = ends;
            let counts = self.active[agent] || !self.has(Flaw::CutOffActiveOnly);
            out.truncated[agent] = self.elapsed >= max_steps && counts;
        }
    }

    fn change_goals(&mut self) {
        for agent in 0..self.cells.len() {
            match self.config.on_goal {
                OnGoal::Finish if self.on_goal[agent] => {
                    self.active[agent] = false;
                    if !self.has(Flaw::FinishedStillBlock) && !self.has(Flaw::FinishedAreSeen) {
                        self.occupied.remove(&self.cells[agent]);
                    }
                }
                OnGoal::Restart if self.on_goal[agent] => {
                    let next = place(self.streams[agent].advance(cell(self.cells[agent])));
                    let is_first_again = next == place(self.instance.goals()[agent].first());
                    if !(self.has(Flaw::SequenceStopsAtItsEnd) && is_first_again) {
                        self.goals[agent] = next;
                    }
                }
                _ => {}
            }
        }
    }

    fn note_cells(&mut self) {
        self.seen = [&self.cells, &self.goals].map(|places| places.iter().copied().map(cell).collect());
    }

    fn mark_on_goal(&mut self) {
        let reached = |agent: usize| self.active[agent] && self.cells[agent] == self.goals[agent];
        self.on_goal = (0..self.cells.len()).map(reached).collect();
    }

    fn window(&self, agent: usize, looks: impl Fn(Place) -> bool) -> Vec<bool> {
        let radius = self.config.radius as i32;
        let (row, col) = self.cells[agent];
        if self.has(Flaw::FinishedSeeNothing) && !self.active[agent] {
            return vec![false; self.config.side() * self.config.side()];
        }
        let mut seen = Vec::new();
        for down in -radius..=radius {
            for right in -radius..=radius {
                let (down, right) =
                    if self.has(Flaw::WindowTransposed) { (right, down) } else { (down, right) };
                seen.push(looks((row + down, col + right)));
            }
        }
        seen
    }

    fn agents_window(&self, agent: usize) -> Vec<bool> {
        let own = self.cells[agent];
        self.window(agent, |at| self.occupied.contains(&at) && !(self.has(Flaw::SelfUnseen) && at == own))
    }

    fn goal_window(&self, agent: usize) -> Vec<bool> {
        let radius = self.config.radius as i32;
        let (row, col) = self.cells[agent];
        let (down, right) = (self.goals[agent].0 - row, self.goals[agent].1 - col);
        let longest = down.abs().max(right.abs());
        let clamp = |away: i32| away.clamp(-radius, radius);
        let (down, right) = match self.flaw {
            Flaw::GoalNormalised if longest > radius => {
                let along = |away: i32| (f64::from(away * radius) / f64::from(longest)).round() as i32;
                (along(down), along(right))
            }
            Flaw::GoalClampedByLongerAxis if longest > radius && down.abs() > right.abs() => (clamp(down), 0),
            Flaw::GoalClampedByLongerAxis if longest > radius => (0, clamp(right)),
            _ => (clamp(down), clamp(right)),
        };
        self.window(agent, |at| at == (row + down, col + right))
    }

    /// Copies flags into a caller's buffer, agent by agent.
    fn write(&self, out: &mut [f32], window: impl Fn(&Self, usize) -> Vec<bool>) {
        let flags = (0..self.cells.len()).flat_map(|agent| window(self, agent));
        out.iter_mut().zip(flags).for_each(|(value, flag)| *value = f32::from(u8::from(flag)));
    }
}

impl Environment for Flawed {
    fn config(&self) -> &Config {
        &self.config
    }

    fn reset(&mut self, instance: &Instance) -> Result<(), Error> {
        instance.check_fits(&self.config)?;
        self.instance = instance.clone();
        self.cells = instance.starts().iter().copied().map(place).collect();
        self.goals = instance.first_goals().into_iter().map(place).collect();
        self.streams = instance.goals().to_vec();
        self.active = vec![true; self.cells.len()];
        self.occupied = self.cells.iter().copied().collect();
        self.elapsed = 0;
        self.mark_on_goal();
        if self.has(Flaw::StartOnGoalFinishes) && self.config.on_goal == OnGoal::Finish {
            self.change_goals();
        }
        self.note_cells();
        Ok(())
    }

    fn step(&mut self, actions: &[Action], mut out: StepOut<'_>) -> Result<(), Error> {
        Error::check_length("actions", self.cells.len(), actions.len())?;
        let is_over = self.elapsed >= self.config.max_steps.max(1);
        if !(self.has(Flaw::StandsStillAfterTheEnd) && is_over) {
            self.move_agents(actions);
        }
        if self.config.occupancy == Occupancy::Exact {
            self.mark_all();
        }
        self.elapsed += 1;
        self.mark_on_goal();
        if self.has(Flaw::GoalChangesBeforeReward) && self.config.on_goal == OnGoal::Restart {
            self.change_goals();
            let reached = std::mem::replace(&mut self.on_goal, vec![false; self.cells.len()]);
            self.pay_and_end(&mut out);
            self.on_goal = reached;
        } else {
            self.pay_and_end(&mut out);
            self.change_goals();
        }
        self.note_cells();
        Ok(())
    }

    fn restore(&mut self, step: u64, state: &Snapshot) -> Result<(), Error> {
        let map = self.instance.map();
        state.check_fits(self.config.num_agents, (map.height(), map.width()))?;
        self.cells = state.cells.iter().copied().map(place).collect();
        if !self.has(Flaw::BackKeepsGoals) {
            self.goals = state.goals.iter().copied().map(place).collect();
        }
        self.active.clone_from(&state.active);
        self.occupied = state.occupied.iter().copied().map(place).collect();
        if !self.has(Flaw::BackKeepsTime) {
            self.elapsed = step as i64;
        }
        self.note_cells();
        Ok(())
    }

    fn state(&self) -> State<'_> {
        let [cells, goals] = &self.seen;
        let Self { active, on_goal, .. } = self;
        State { step: self.elapsed as u64, cells, goals, active, on_goal }
    }

    fn occupied(&self) -> Vec<Cell> {
        let mut occupied: Vec<Cell> = self.occupied.iter().copied().map(cell).collect();
        occupied.sort_by_key(|cell| (cell.row, cell.col));
        occupied
    }

    fn observe(&self, out: &mut [f32]) -> Result<(), Error> {
        Error::check_length("observations", self.config.num_observed(), out.len())?;
        self.write(out, |this, agent| {
            let obstacles = this.window(agent, |at| this.looks_blocked(at));
            [obstacles, this.agents_window(agent), this.goal_window(agent)].concat()
        });
        Ok(())
    }

    fn observe_map(&self, out: &mut [u8]) -> Result<(), Error> {
        let radius = self.config.radius as i32;
        let map = self.instance.map();
        let (height, width) = (map.height() as i32, map.width() as i32);
        let rows = -radius..height + radius;
        let places = rows.flat_map(|row| (-radius..width + radius).map(move |col| (row, col)));
        out.iter_mut().zip(places).for_each(|(value, at)| *value = u8::from(self.looks_blocked(at)));
        Ok(())
    }
}
