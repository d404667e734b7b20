//! Steps kept, and taken back.

use std::collections::HashSet;

use pogema_core::{Environment, Error, GoalStream, Instance, Snapshot};

use crate::Engine;

impl Engine {
    /// All states since the reset, if the config keeps them.
    ///
    /// Rule: history/changes
    pub fn past(&self) -> &[Snapshot] {
        &self.past
    }

    pub(crate) fn remember(&mut self) {
        if self.config.persistent {
            self.past.push(self.snapshot());
        }
    }

    /// Goes on with an episode at a later state, its goals as far as they had come; `past` holds the kept steps.
    ///
    /// # Errors
    /// If the states do not fit the instance, or the instance does not fit the config.
    pub fn resume(
        &mut self,
        instance: &Instance,
        streams: Vec<GoalStream>,
        now: Snapshot,
        past: Vec<Snapshot>,
    ) -> Result<(), Error> {
        instance.check_fits(&self.config)?;
        let fits = |snapshot: &Snapshot| snapshot_fits(snapshot, instance);
        if streams.len() != instance.goals().len() || !fits(&now) || !past.iter().all(fits) {
            return Err(Error::State { reason: "the state does not fit the map and its agents".into() });
        }
        self.reset(instance)?;
        self.streams = streams;
        self.on_goal.clone_from(&now.on_goal);
        self.num_on_goal = self.on_goal.iter().filter(|&&on_goal| on_goal).count();
        self.take_on(now);
        self.past = past;
        Ok(())
    }

    /// Rule: history/step-back
    pub(crate) fn take_back(&mut self) -> Result<bool, Error> {
        if !self.config.persistent {
            return Err(Error::State { reason: "steps are only kept with persistent: true".into() });
        }
        if self.past.len() < 2 {
            return Ok(false);
        }
        self.past.pop();
        let Some(before) = self.past.last().cloned() else { return Ok(false) };
        self.take_on(before);
        Ok(true)
    }

    /// Puts agents, goals and marks where a snapshot has them; what was on a goal stays.
    fn take_on(&mut self, before: Snapshot) {
        for agent in 0..self.cells.len() {
            self.vacate(self.board.place(self.cells[agent]), agent as u32, false);
        }
        self.occupied.clear_all();
        for &cell in &before.occupied {
            self.mark(cell);
        }
        self.step = before.step;
        self.cells = before.cells;
        self.goals = before.goals;
        self.active = before.active;
        self.take_squares();
    }
}

fn snapshot_fits(snapshot: &Snapshot, instance: &Instance) -> bool {
    let num_agents = instance.starts().len();
    let lengths = [snapshot.cells.len(), snapshot.goals.len(), snapshot.active.len(), snapshot.on_goal.len()];
    let mut cells = snapshot.cells.iter().chain(&snapshot.goals).chain(&snapshot.occupied);
    let places = snapshot.cells.iter().zip(&snapshot.active).filter(|(_, active)| **active);
    let mut taken = HashSet::new();
    lengths == [num_agents; 4]
        && cells.all(|&cell| instance.map().contains(cell))
        && places.map(|(cell, _)| cell).all(|cell| taken.insert(cell))
}
