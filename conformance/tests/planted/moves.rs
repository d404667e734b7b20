//! Bugs in moves: agents that stay although they may move, and agents that move although they have to stay.

use pogema_core::{Action, Cell, Collision, Config, Map, Snapshot};

use crate::bug::Bug;

/// A cell, or a position next to the map.
type Place = (i32, i32);

/// The requested moves of one step, and the changes that a bug makes to them.
pub struct Moves<'a> {
    bug: Bug,
    config: &'a Config,
    map: &'a Map,
    before: &'a Snapshot,
    is_over: bool,
    actions: Vec<Action>,
    cells: Vec<Place>,
    targets: Vec<Place>,
}

impl<'a> Moves<'a> {
    /// Creates the requested moves; `is_over` says whether the step limit has already been reached.
    pub fn new(
        bug: Bug,
        config: &'a Config,
        map: &'a Map,
        before: &'a Snapshot,
        is_over: bool,
        actions: &[Action],
    ) -> Self {
        let actions: Vec<Action> = actions.iter().map(|&action| misread_action(bug, action)).collect();
        let cells = before.cells.iter().map(|cell| cell.toward(Action::Stay)).collect();
        let targets = before.cells.iter().zip(&actions).map(|(cell, &action)| cell.toward(action)).collect();
        Self { bug, config, map, before, is_over, actions, cells, targets }
    }

    /// Returns the actions. If the bug holds an agent back, the agent waits.
    pub fn played(&self) -> Vec<Action> {
        let agents = self.actions.iter().enumerate();
        agents.map(|(agent, &action)| if self.is_kept_back(agent) { Action::Stay } else { action }).collect()
    }

    /// Moves the agents that stayed in `after`, but move with the bug.
    pub fn add_missing(&self, after: &mut Snapshot) {
        let stayed =
            |agent: usize| self.tries_to_move(agent) && after.cells[agent] == self.before.cells[agent];
        let is_missing = |&agent: &usize| stayed(agent) && self.moves_despite_rules(agent, &after.cells);
        let missing: Vec<usize> = (0..self.targets.len()).filter(is_missing).collect();
        for agent in missing {
            let (row, col) = self.targets[agent];
            after.cells[agent] = Cell::new(row as u16, col as u16);
        }
    }

    fn is_kept_back(&self, agent: usize) -> bool {
        let leads_to_finished =
            |other: usize| !self.before.active[other] && self.cells[other] == self.targets[agent];
        let follows = self.occupant(agent).is_some();
        match (self.bug, self.config.collision) {
            (Bug::NoMovesAfterTheEnd, _) => self.is_over,
            (Bug::FinishedStillBlock, _) => (0..self.cells.len()).any(leads_to_finished),
            (Bug::PriorityHighestFirst, Collision::Priority) => {
                self.rivals(agent).any(|other| other > agent)
                    || self.occupant(agent).is_some_and(|other| other < agent)
            }
            (Bug::PriorityNoFollowing, Collision::Priority) | (Bug::SoftNoFollowing, Collision::Soft) => {
                follows
            }
            (Bug::BlockBothLowestEnters, Collision::BlockBoth) => self.has_lower_rival(agent),
            (Bug::SoftHighestWins, Collision::Soft) => self.rivals(agent).any(|other| other > agent),
            (Bug::SoftAllContendersStay, Collision::Soft) => self.rivals(agent).next().is_some(),
            (Bug::SoftNoRotation, Collision::Soft) => self.rotates(agent),
            _ => false,
        }
    }

    fn moves_despite_rules(&self, agent: usize, after: &[Cell]) -> bool {
        let target = self.targets[agent];
        if self.bug == Bug::FinishedMove {
            let is_taken = after.iter().any(|cell| cell.toward(Action::Stay) == target);
            return !self.before.active[agent] && !self.is_blocked(target) && !is_taken;
        }
        if self.bug == Bug::MapHasNoWall {
            return !self.is_on_map(target);
        }
        let Some(ahead) = self.occupant(agent) else { return false };
        match (self.bug, self.config.collision) {
            (Bug::PriorityHighestFirst, Collision::Priority) => {
                ahead > agent && after[ahead] != self.before.cells[ahead]
            }
            (Bug::BlockBothFollows, Collision::BlockBoth) => {
                self.tries_to_move(ahead) && self.rivals(agent).next().is_none()
            }
            (Bug::SoftSwaps, Collision::Soft) => self.targets[ahead] == self.cells[agent],
            (Bug::SoftOnlyDirectConflicts, Collision::Soft) => self.distance_to_cause(agent) >= 2,
            (Bug::SoftChainStopsAfterOne, Collision::Soft) => self.distance_to_cause(agent) >= 3,
            (Bug::SoftWaitClaimsNothing, Collision::Soft) => {
                !self.tries_to_move(ahead) && !self.has_lower_rival(agent)
            }
            (Bug::SoftObstaclesLast, Collision::Soft) => {
                self.is_blocked(self.targets[ahead]) && !self.has_lower_rival(agent)
            }
            _ => false,
        }
    }

    fn tries_to_move(&self, agent: usize) -> bool {
        self.targets[agent] != self.cells[agent]
    }

    fn is_on_map(&self, (row, col): Place) -> bool {
        (0..self.map.height() as i32).contains(&row) && (0..self.map.width() as i32).contains(&col)
    }

    fn is_blocked(&self, place: Place) -> bool {
        !self.is_on_map(place) || self.map.is_obstacle(Cell::new(place.0 as u16, place.1 as u16))
    }

    /// Returns the other active agent on the target cell of an agent.
    fn occupant(&self, agent: usize) -> Option<usize> {
        let is_there = |&other: &usize| {
            other != agent && self.before.active[other] && self.cells[other] == self.targets[agent]
        };
        (0..self.cells.len()).find(is_there)
    }

    /// Returns the other active agents that try to enter the same cell.
    fn rivals(&self, agent: usize) -> impl Iterator<Item = usize> {
        let target = self.targets[agent];
        (0..self.cells.len()).filter(move |&other| {
            other != agent
                && self.before.active[other]
                && self.tries_to_move(other)
                && self.targets[other] == target
        })
    }

    fn has_lower_rival(&self, agent: usize) -> bool {
        self.rivals(agent).any(|other| other < agent)
    }

    /// Returns whether an agent is part of a ring in which each agent requests the cell of the next one.
    fn rotates(&self, agent: usize) -> bool {
        let next = |&other: &usize| self.occupant(other);
        std::iter::successors(self.occupant(agent), next).take(self.cells.len()).any(|other| other == agent)
    }

    /// Returns the distance between an agent that stays and the cause of its stay, counted in agents. The distance is 0
    /// if the agent itself waits, swaps or moves into an obstacle, and 1 if another agent keeps or wins the cell.
    fn distance_to_cause(&self, agent: usize) -> usize {
        let ahead = self.occupant(agent);
        let swaps = ahead.is_some_and(|other| self.targets[other] == self.cells[agent]);
        if !self.tries_to_move(agent) || swaps || self.is_blocked(self.targets[agent]) {
            return 0;
        }
        match ahead {
            Some(other) if !self.has_lower_rival(agent) => 1 + self.distance_to_cause(other),
            _ => 1,
        }
    }
}

/// Returns an action as a port with this bug reads it.
fn misread_action(bug: Bug, action: Action) -> Action {
    use Action::{Down, Left, Right, Stay, Up};
    let actions = match bug {
        Bug::UpIsDown => [Stay, Down, Up, Left, Right],
        Bug::RowsAreColumns => [Stay, Left, Right, Up, Down],
        _ => Action::ALL,
    };
    actions[action as usize]
}
