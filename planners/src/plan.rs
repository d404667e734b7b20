//! Plans: the cell of each agent after each step.

use pogema_core::{Action, Cell, Error, counted};

/// The cells of all agents at the start and after each step.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Shape: `[steps + 1, agents]`
    cells: Vec<Vec<Cell>>,
}

impl Plan {
    /// Creates a plan from the cells of all agents at the start and after each step.
    ///
    /// # Errors
    /// [`Error::Instance`] without a start; [`Error::Plan`] unless every step has as many agents as the start.
    /// [`crate::validate()`] checks whether the moves are valid.
    pub fn new(cells: Vec<Vec<Cell>>) -> Result<Self, Error> {
        let num_agents = cells.first().ok_or_else(|| Error::instance("the plan has no start"))?.len();
        if let Some((step, found)) = cells.iter().enumerate().find(|(_, found)| found.len() != num_agents) {
            let found = counted(found.len(), "cell");
            let reason = format!("step {step} has {found}, expected {num_agents}, as at the start");
            return Err(Error::Plan { reason });
        }
        Ok(Self { cells })
    }

    /// Returns the cells of all agents at the start and after each step.
    pub fn cells(&self) -> &[Vec<Cell>] {
        &self.cells
    }

    /// Returns the number of agents.
    pub fn num_agents(&self) -> usize {
        self.cells[0].len()
    }

    /// Returns the number of steps. It exceeds the makespan if the last steps are idle.
    pub fn num_steps(&self) -> usize {
        self.cells.len() - 1
    }

    /// Returns the cost of each agent: the step after which it stays at its last cell.
    pub fn arrivals(&self) -> Vec<usize> {
        let arrival = |agent: usize| {
            let end = self.cells[self.num_steps()][agent];
            self.cells.iter().rposition(|step| step[agent] != end).map_or(0, |step| step + 1)
        };
        (0..self.num_agents()).map(arrival).collect()
    }

    /// Returns the sum of costs: the costs of all agents, summed. Units: steps.
    pub fn sum_of_costs(&self) -> usize {
        self.arrivals().into_iter().sum()
    }

    /// Returns the makespan: the highest cost of an agent. Units: steps.
    pub fn makespan(&self) -> usize {
        self.arrivals().into_iter().max().unwrap_or(0)
    }

    /// Returns the action of each agent in a step, counted from 0. After the last step, all agents stay.
    ///
    /// # Errors
    /// [`Error::Plan`] if no action leads an agent to its next cell.
    pub fn actions(&self, step: usize) -> Result<Vec<Action>, Error> {
        let (Some(now), Some(next)) = (self.cells.get(step), self.cells.get(step + 1)) else {
            return Ok(vec![Action::Stay; self.num_agents()]);
        };
        let action = |(agent, (&from, &to)): (usize, (&Cell, &Cell))| {
            let expected = "expected the same cell or a neighbour";
            from.action_to(to).ok_or_else(|| Error::Plan {
                reason: format!("step {}: agent {agent} moves from {from} to {to}, {expected}", step + 1),
            })
        };
        now.iter().zip(next).enumerate().map(action).collect()
    }
}
