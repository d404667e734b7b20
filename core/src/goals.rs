//! The goals of one agent, in order.

use std::fmt::Debug;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::{Cell, Error};

/// A source of an agent's next goals, which are the only random draws of an episode.
///
/// The goals may depend only on the state of the source and on the cell of the agent. An episode therefore stays a
/// function of its instance and actions.
///
/// Rule: goal/restart/draw
pub trait GoalSource: Debug + Send + Sync {
    /// Returns the goal after the one that was just reached at `at`.
    fn next_goal(&mut self, at: Cell) -> Cell;

    /// Returns the state as a text for [`GoalSource::restore`], or `None` if it cannot be saved.
    fn save(&self) -> Option<String> {
        None
    }

    /// Restores the state saved by a source for the same map and goals. Returns false if the text is not such a state.
    fn restore(&mut self, _saved: &str) -> bool {
        false
    }

    /// Clones the source with its state.
    fn boxed_clone(&self) -> Box<dyn GoalSource>;
}

/// The goals of one agent: a first goal, and a next one each time the agent reaches its goal.
#[derive(Debug)]
pub struct GoalStream {
    first: Cell,
    rest: Rest,
}

#[derive(Debug)]
enum Rest {
    Same,
    Sequence { cells: Arc<[Cell]>, index: usize },
    Drawn(Box<dyn GoalSource>),
}

/// The saved position of an agent in its goals.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StreamState {
    /// The goal never changes.
    Same,
    /// The index of the current goal in a sequence, from 0.
    #[serde(rename = "turn")]
    Sequence(usize),
    /// The saved state of a [`GoalSource`].
    Drawn(String),
}

impl GoalStream {
    /// Creates a stream of a single goal, which is always its own next goal.
    pub fn single(goal: Cell) -> Self {
        Self { first: goal, rest: Rest::Same }
    }

    /// Creates a stream that begins with `first` and continues cyclically through `cells`, from the second cell on.
    ///
    /// If `cells` is empty, the first goal is the only one.
    ///
    /// Rule: goal/restart/sequence
    pub fn sequence(first: Cell, cells: Arc<[Cell]>) -> Self {
        if cells.is_empty() {
            return Self::single(first);
        }
        Self { first, rest: Rest::Sequence { cells, index: 0 } }
    }

    /// Creates a stream of a first goal, followed by the goals that the source draws.
    ///
    /// Rule: goal/restart/draw
    pub fn drawn(first: Cell, source: Box<dyn GoalSource>) -> Self {
        Self { first, rest: Rest::Drawn(source) }
    }

    /// Returns the first goal.
    pub fn first(&self) -> Cell {
        self.first
    }

    /// Returns all goals that are known: the first one and, for a sequence, all others.
    pub fn known(&self) -> impl Iterator<Item = Cell> {
        let rest = match &self.rest {
            Rest::Sequence { cells, .. } => &cells[..],
            Rest::Same | Rest::Drawn(_) => &[],
        };
        std::iter::once(self.first).chain(rest.iter().copied())
    }

    /// Returns the length of a cyclic sequence and the index of the current goal in it, or `None` for other goals.
    pub fn sequence_position(&self) -> Option<(usize, usize)> {
        match &self.rest {
            Rest::Sequence { cells, index } => Some((cells.len(), *index)),
            Rest::Same | Rest::Drawn(_) => None,
        }
    }

    /// Returns the position in the stream, for [`GoalStream::restore`].
    ///
    /// # Errors
    /// [`Error::UnsavedGoals`] if the goals come from a source that cannot be saved.
    pub fn save(&self) -> Result<StreamState, Error> {
        let state = match &self.rest {
            Rest::Same => StreamState::Same,
            Rest::Sequence { index, .. } => StreamState::Sequence(*index),
            Rest::Drawn(source) => StreamState::Drawn(source.save().ok_or(Error::UnsavedGoals)?),
        };
        Ok(state)
    }

    /// Continues at the saved position of a stream of the same goals.
    ///
    /// # Errors
    /// [`Error::ForeignGoals`] if the state cannot belong to these goals.
    pub fn restore(&mut self, state: &StreamState) -> Result<(), Error> {
        let fits = match (&mut self.rest, state) {
            (Rest::Same, StreamState::Same) => true,
            (Rest::Sequence { cells, index }, StreamState::Sequence(saved)) if *saved < cells.len() => {
                *index = *saved;
                true
            }
            (Rest::Drawn(source), StreamState::Drawn(saved)) => source.restore(saved),
            _ => false,
        };
        if fits { Ok(()) } else { Err(Error::ForeignGoals) }
    }

    /// Advances to the goal after the one reached at `at`, and returns it.
    pub fn advance(&mut self, at: Cell) -> Cell {
        match &mut self.rest {
            Rest::Same => self.first,
            Rest::Sequence { cells, index } => {
                *index = (*index + 1) % cells.len();
                cells[*index]
            }
            Rest::Drawn(source) => source.next_goal(at),
        }
    }

    /// Returns the first `count` goals of a stream that has not advanced, as if each were reached in turn.
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
            Rest::Sequence { cells, index } => Rest::Sequence { cells: Arc::clone(cells), index: *index },
            Rest::Drawn(source) => Rest::Drawn(source.boxed_clone()),
        };
        Self { first: self.first, rest }
    }
}
