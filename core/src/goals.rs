//! The goals of one agent, one after the other.

use std::fmt::Debug;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::{Cell, Error};

/// Draws an agent's next goal; the engines know no other randomness.
///
/// It may depend on its own state and on where the agent stands, and on nothing else, so that an episode
/// stays a function of its instance and actions.
///
/// Rule: goal/restart/draw
pub trait GoalSource: Debug + Send + Sync {
    /// The goal after the one just reached at `at`.
    fn next_goal(&mut self, at: Cell) -> Cell;

    /// Its state as a text, from which [`GoalSource::restore`] goes on; none if it cannot be kept.
    fn save(&self) -> Option<String> {
        None
    }

    /// Takes on the state that a source for the same map and goals was saved in; says whether the text was one.
    fn restore(&mut self, _saved: &str) -> bool {
        false
    }

    /// The same source in the same state.
    fn boxed_clone(&self) -> Box<dyn GoalSource>;
}

/// The goals of one agent: a first one, and more as they are reached.
#[derive(Debug)]
pub struct GoalStream {
    first: Cell,
    rest: Rest,
}

#[derive(Debug)]
enum Rest {
    Same,
    Cycle { cells: Arc<[Cell]>, index: usize },
    Drawn(Box<dyn GoalSource>),
}

/// How far the goals of one agent are.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StreamState {
    /// There is one goal for ever.
    Same,
    /// Which goal of a sequence it is, from 0.
    Turn(usize),
    /// The state of a source, as it gave it.
    Drawn(String),
}

impl GoalStream {
    /// One goal for ever; as the next goal it gives itself.
    pub fn single(goal: Cell) -> Self {
        Self { first: goal, rest: Rest::Same }
    }

    /// A first goal, then `cells` from their second one on, round and round.
    ///
    /// An empty list stands for the first goal alone.
    ///
    /// Rule: goal/restart/sequence
    pub fn sequence(first: Cell, cells: Arc<[Cell]>) -> Self {
        if cells.is_empty() {
            return Self::single(first);
        }
        Self { first, rest: Rest::Cycle { cells, index: 0 } }
    }

    /// A first goal, then what the source draws.
    ///
    /// Rule: goal/restart/draw
    pub fn drawn(first: Cell, source: Box<dyn GoalSource>) -> Self {
        Self { first, rest: Rest::Drawn(source) }
    }

    /// The first goal.
    pub fn first(&self) -> Cell {
        self.first
    }

    /// How many cells the goals go round, if they do, and which of them is the present one, from 0.
    pub fn turn(&self) -> Option<(usize, usize)> {
        match &self.rest {
            Rest::Cycle { cells, index } => Some((cells.len(), *index)),
            Rest::Same | Rest::Drawn(_) => None,
        }
    }

    /// How far the stream is, to go on from there later.
    ///
    /// # Errors
    /// If its goals come from a source that cannot be kept.
    pub fn save(&self) -> Result<StreamState, Error> {
        let state = match &self.rest {
            Rest::Same => StreamState::Same,
            Rest::Cycle { index, .. } => StreamState::Turn(*index),
            Rest::Drawn(source) => StreamState::Drawn(source.save().ok_or(Error::ForeignGoals)?),
        };
        Ok(state)
    }

    /// Goes on from where a stream of the same goals was saved.
    ///
    /// # Errors
    /// If the state is none of such a stream.
    pub fn restore(&mut self, state: &StreamState) -> Result<(), Error> {
        let fits = match (&mut self.rest, state) {
            (Rest::Same, StreamState::Same) => true,
            (Rest::Cycle { cells, index }, StreamState::Turn(saved)) if *saved < cells.len() => {
                *index = *saved;
                true
            }
            (Rest::Drawn(source), StreamState::Drawn(saved)) => source.restore(saved),
            _ => false,
        };
        if fits { Ok(()) } else { Err(Error::ForeignGoals) }
    }

    /// The goal that follows the one reached at `at`.
    pub fn advance(&mut self, at: Cell) -> Cell {
        match &mut self.rest {
            Rest::Same => self.first,
            Rest::Cycle { cells, index } => {
                *index = (*index + 1) % cells.len();
                cells[*index]
            }
            Rest::Drawn(source) => source.next_goal(at),
        }
    }

    /// The first `count` goals, each reached in turn.
    pub fn list(&self, count: usize) -> Vec<Cell> {
        let mut stream = self.clone();
        let mut at = self.first;
        let mut goals = Vec::with_capacity(count);
        while goals.len() < count {
            goals.push(at);
            at = stream.advance(at);
        }
        goals
    }
}

impl Clone for GoalStream {
    fn clone(&self) -> Self {
        let rest = match &self.rest {
            Rest::Same => Rest::Same,
            Rest::Cycle { cells, index } => Rest::Cycle { cells: Arc::clone(cells), index: *index },
            Rest::Drawn(source) => Rest::Drawn(source.boxed_clone()),
        };
        Self { first: self.first, rest }
    }
}
