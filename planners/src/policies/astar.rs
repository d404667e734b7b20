//! POGEMA's A* policy: every agent plans alone and ignores the others.
//!
//! Source: POGEMA 1.4.0, `a_star_policy.py`

use std::collections::{HashMap, HashSet};

use pogema_core::{Action, Error};
use pogema_numpy::Generator;

use crate::heapq::{HeapQ, Precedes};
use crate::policies::observations::PomapfObservation;
use crate::policies::pogema::random_action;

/// A cell relative to the start of the agent, (row, col).
type Place = (i32, i32);

/// The node limit of a search.
const MAX_EXPANSIONS: usize = 10_000;

/// One agent, which follows a shortest path around the obstacles it has seen.
///
/// If it did not move in a step and is not on its goal, it acts at random until it moves again.
///
/// Rule: policy/astar
pub struct AStarAgent {
    obstacles: HashSet<Place>,
    last: Option<Place>,
    random_action: Box<dyn FnMut() -> Action + Send>,
}

impl AStarAgent {
    /// Creates an agent without knowledge of the map, with a source of random actions.
    pub fn new(random_action: Box<dyn FnMut() -> Action + Send>) -> Self {
        Self { obstacles: HashSet::new(), last: None, random_action }
    }

    /// Returns the next action.
    ///
    /// # Errors
    /// [`Error::OutOfStep`] if the agent is more than one step away from its last cell.
    ///
    /// Rule: policy/astar
    pub fn act(&mut self, observation: PomapfObservation<'_>) -> Result<Action, Error> {
        let [row, col] = observation.cell;
        let (cell, goal) = ((row, col), (observation.goal[0], observation.goal[1]));
        if let Some(last) = self.last {
            match distance(last, cell) {
                0 if cell != goal => return Ok((self.random_action)()),
                0 | 1 => {}
                _ => {
                    let reason = format!(
                        "found the A* agent at {cell:?}, expected at most one step from {last:?} (relative to its \
                         start); clear it before a new episode"
                    );
                    return Err(Error::OutOfStep { reason });
                }
            }
        }
        self.look(cell, &observation);
        self.last = Some(cell);
        Ok(first_move(cell, goal, &self.obstacles))
    }

    /// Forgets the obstacles and the last cell; the source of random actions continues its stream.
    pub fn forget(&mut self) {
        self.obstacles.clear();
        self.last = None;
    }

    /// Returns what the agent remembers of the episode: the obstacles in order, and its last cell.
    ///
    /// Cells are (row, col) relative to the agent's start.
    pub fn memory(&self) -> (Vec<Place>, Option<Place>) {
        let mut obstacles: Vec<_> = self.obstacles.iter().copied().collect();
        obstacles.sort_unstable();
        (obstacles, self.last)
    }

    /// Replaces what the agent remembers of the episode, in the form of [`AStarAgent::memory`].
    pub fn remember(&mut self, obstacles: Vec<Place>, last: Option<Place>) {
        self.obstacles = obstacles.into_iter().collect();
        self.last = last;
    }

    /// Updates the known obstacles within the observation window. Other agents are not obstacles.
    fn look(&mut self, (row, col): Place, observation: &PomapfObservation<'_>) {
        let radius = observation.side as i32 / 2;
        for (line, values) in observation.obstacles.chunks(observation.side).enumerate() {
            for (place, &value) in values.iter().enumerate() {
                let at = (row + line as i32 - radius, col + place as i32 - radius);
                if value == 0.0 {
                    self.obstacles.remove(&at);
                } else {
                    self.obstacles.insert(at);
                }
            }
        }
    }
}

impl std::fmt::Debug for AStarAgent {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("AStarAgent").field("last", &self.last).finish_non_exhaustive()
    }
}

/// POGEMA's A* policy: one [`AStarAgent`] for each agent of an environment, each of which draws its random moves from a
/// generator with seed 0.
///
/// Rule: policy/astar
#[derive(Debug, Default)]
pub struct AStarTeam {
    agents: Vec<AStarAgent>,
}

/// Returns POGEMA's A* policy before the first step of an episode.
///
/// Rule: policy/astar
pub fn pogema_team() -> AStarTeam {
    AStarTeam::default()
}

impl AStarTeam {
    /// Clears the state of the episode.
    pub fn reset(&mut self) {
        self.agents.clear();
    }

    /// Returns the next action of each agent.
    ///
    /// # Errors
    /// As [`AStarAgent::act`].
    pub fn act<'a>(
        &mut self,
        observations: impl IntoIterator<Item = PomapfObservation<'a>>,
    ) -> Result<Vec<Action>, Error> {
        let mut actions = Vec::new();
        for (index, observation) in observations.into_iter().enumerate() {
            if index == self.agents.len() {
                let mut generator = Generator::seeded(0);
                self.agents.push(AStarAgent::new(Box::new(move || random_action(&mut generator))));
            }
            actions.push(self.agents[index].act(observation)?);
        }
        Ok(actions)
    }
}

#[derive(Clone, Copy, Debug)]
struct Node {
    place: Place,
    /// Number of steps from the start.
    g: i32,
    /// The g-value plus the Manhattan distance to the goal.
    f: i32,
}

impl Precedes for Node {
    /// POGEMA's comparison: by f-value, then by lower g-value, then by a relation that is not an order.
    fn precedes(&self, other: &Self) -> bool {
        if self.f != other.f {
            return self.f < other.f;
        }
        if self.g != other.g {
            return self.g < other.g;
        }
        self.place.0 < other.place.0 || self.place.1 < other.place.1
    }
}

fn distance(one: Place, other: Place) -> i32 {
    (one.0 - other.0).abs() + (one.1 - other.1).abs()
}

/// Returns the first move of the path to the goal, or a wait if no path was found.
fn first_move(start: Place, goal: Place, obstacles: &HashSet<Place>) -> Action {
    let came_from = search(start, goal, obstacles);
    let mut at = goal;
    let mut action = Action::Stay;
    while let Some(&Some((from, step))) = came_from.get(&at) {
        (at, action) = (from, step);
    }
    action
}

/// Returns the predecessor and the move by which each cell was first reached.
fn search(start: Place, goal: Place, obstacles: &HashSet<Place>) -> HashMap<Place, Option<(Place, Action)>> {
    let mut came_from = HashMap::from([(start, None)]);
    let mut open = HeapQ::default();
    open.push(Node { place: start, g: 0, f: distance(start, goal) });
    for _ in 0..MAX_EXPANSIONS {
        let Some(node) = open.pop() else { break };
        for action in Action::MOVES {
            let (down, right) = action.delta();
            let place = (node.place.0 + down, node.place.1 + right);
            if obstacles.contains(&place) || came_from.contains_key(&place) {
                continue;
            }
            came_from.insert(place, Some((node.place, action)));
            let g = node.g + 1;
            open.push(Node { place, g, f: g + distance(place, goal) });
        }
        if node.place == goal || open.is_empty() {
            break;
        }
    }
    came_from
}
