//! The interface of lifelong planners.

use pogema_core::Error;

use crate::budget::Budget;
use crate::graph::Vertex;
use crate::problem::shared_vertex;

/// A lifelong planner, which chooses the moves of all agents one step at a time.
///
/// It knows the current goal of each agent; only [`Lifelong::next_with_future_goals`] provides later ones. Positions
/// and goals may change arbitrarily between calls; the planner then drops the plans that no longer fit.
pub trait Lifelong: Send {
    /// Clears the state of the episode. Afterwards the same calls return the same moves again.
    fn reset(&mut self);

    /// Returns the vertex of each agent after the next step, without vertex or edge conflicts.
    ///
    /// # Errors
    /// [`Error::Length`] unless each agent has a goal; [`Error::Agent`] for a vertex that is not in the graph or that
    /// holds two agents.
    fn next(&mut self, now: &[Vertex], goals: &[Vertex], budget: &Budget) -> Result<Vec<Vertex>, Error>;

    /// Returns whether the planner uses future goals.
    fn uses_future_goals(&self) -> bool {
        false
    }

    /// Works like [`Lifelong::next`], but also gets future goals; the list of each agent begins with its current goal.
    ///
    /// # Errors
    /// As for [`Lifelong::next`]; [`Error::Agent`] also for an agent without a goal.
    fn next_with_future_goals(
        &mut self,
        now: &[Vertex],
        goals: &[Vec<Vertex>],
        budget: &Budget,
    ) -> Result<Vec<Vertex>, Error> {
        self.next(now, &current_goals(goals)?, budget)
    }
}

/// Returns the current goal of each agent.
///
/// # Errors
/// [`Error::Agent`] for an agent without a goal.
pub(crate) fn current_goals(goals: &[Vec<Vertex>]) -> Result<Vec<Vertex>, Error> {
    let first = |(agent, goals): (usize, &Vec<Vertex>)| {
        goals.first().copied().ok_or_else(|| Error::agent(agent, "it has no goal"))
    };
    goals.iter().enumerate().map(first).collect()
}

/// Checks positions and goals.
///
/// # Errors
/// As for [`Lifelong::next`].
pub(crate) fn check_agents(num_vertices: usize, now: &[Vertex], goals: &[Vertex]) -> Result<(), Error> {
    check_vertices(num_vertices, now, goals)?;
    match shared_vertex(now) {
        Some((other, agent, at)) => Err(shares_vertex(agent, at, other)),
        None => Ok(()),
    }
}

/// Checks that each agent has a goal, and that all positions and goals are vertices.
///
/// # Errors
/// As for [`Lifelong::next`].
pub(crate) fn check_vertices(num_vertices: usize, now: &[Vertex], goals: &[Vertex]) -> Result<(), Error> {
    Error::check_length("goals", now.len(), goals.len())?;
    for (agent, (&at, &goal)) in now.iter().zip(goals).enumerate() {
        check_vertex(num_vertices, agent, "position", at)?;
        check_vertex(num_vertices, agent, "goal", goal)?;
    }
    Ok(())
}

/// Checks that a position or a goal of an agent is a vertex.
///
/// # Errors
/// [`Error::Agent`] if it is not.
pub(crate) fn check_vertex(
    num_vertices: usize,
    agent: usize,
    what: &str,
    vertex: Vertex,
) -> Result<(), Error> {
    if (vertex as usize) < num_vertices {
        return Ok(());
    }
    Err(Error::agent(agent, format!("{what} is vertex {vertex}, expected a vertex below {num_vertices}")))
}

/// Returns the error about two agents on one vertex.
pub(crate) fn shares_vertex(agent: usize, at: Vertex, other: usize) -> Error {
    Error::agent(agent, format!("it shares vertex {at} with agent {other}"))
}
