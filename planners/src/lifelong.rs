//! Who moves agents that get a new goal whenever they reach one.

use pogema_core::Error;

use crate::graph::Vertex;
use crate::problem::Budget;

/// Chooses the steps of all agents, one after the other, for as long as it is asked.
///
/// It knows of each agent the goal that it has now and no later one, unless it is told by
/// [`Lifelong::next_foreseeing`]. Agents may be anywhere at the next call, and
/// have any goals: what was planned before is then given up as far as it no longer fits.
pub trait Lifelong: Send {
    /// A short name, as the command line knows it.
    fn name(&self) -> &'static str;

    /// Forgets everything that belongs to an episode; the same calls give the same answers again.
    fn reset(&mut self);

    /// Where each agent is to be after the next step: no two in one cell, no two in each other's place.
    ///
    /// # Errors
    /// [`Error::Length`] unless each agent has a goal; [`Error::Agent`] for a vertex that is not one of the graph or
    /// holds two agents.
    fn next(&mut self, now: &[Vertex], goals: &[Vertex], budget: &Budget) -> Result<Vec<Vertex>, Error>;

    /// Whether it can make use of goals that are still to come.
    fn foresees(&self) -> bool {
        false
    }

    /// As [`Lifelong::next`], for agents that know which goals come after their present ones; each agent's list begins
    /// with its present goal.
    ///
    /// # Errors
    /// As for [`Lifelong::next`]; [`Error::Agent`] also for an agent without a goal.
    fn next_foreseeing(
        &mut self,
        now: &[Vertex],
        goals: &[Vec<Vertex>],
        budget: &Budget,
    ) -> Result<Vec<Vertex>, Error> {
        self.next(now, &present_goals(goals)?, budget)
    }
}

/// The first goal of each agent.
///
/// # Errors
/// [`Error::Agent`] for an agent without a goal.
pub(crate) fn present_goals(goals: &[Vec<Vertex>]) -> Result<Vec<Vertex>, Error> {
    let first = |(agent, goals): (usize, &Vec<Vertex>)| {
        goals.first().copied().ok_or_else(|| Error::agent(agent, "it has no goal"))
    };
    goals.iter().enumerate().map(first).collect()
}

/// Passes if agents can be so.
///
/// # Errors
/// As for [`Lifelong::next`].
pub(crate) fn check_agents(num_vertices: usize, now: &[Vertex], goals: &[Vertex]) -> Result<(), Error> {
    Error::check_length("goals", now.len(), goals.len())?;
    let mut holder = vec![usize::MAX; num_vertices];
    for (agent, (&at, &goal)) in now.iter().zip(goals).enumerate() {
        for (what, vertex) in [("place", at), ("goal", goal)] {
            if vertex as usize >= num_vertices {
                return Err(Error::agent(
                    agent,
                    format!("{what} {vertex} is none of {num_vertices} vertices"),
                ));
            }
        }
        let other = std::mem::replace(&mut holder[at as usize], agent);
        if other != usize::MAX {
            return Err(Error::agent(agent, format!("it is where agent {other} is, at vertex {at}")));
        }
    }
    Ok(())
}
