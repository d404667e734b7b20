//! POGEMA's own A* policy, one agent at a time, each blind to the others.
//!
//! Source: POGEMA 1.4.0, `a_star_policy.py`

use std::collections::{HashMap, HashSet};

use pogema_core::{Action, Error};

use crate::heap::Heap;

/// A place counted from the agent's start, (row, col).
type Place = (i32, i32);

/// How many nodes a search may expand before it gives up.
const MOST_EXPANSIONS: usize = 10_000;

/// What one agent is told: the arrays of the `POMAPF` observation that the policy reads.
///
/// Rule: observe/pomapf
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// Where the agent is, counted from its start.
    pub cell: [i32; 2],
    /// Where its goal is, counted from its start.
    pub goal: [i32; 2],
    /// Shape: `[side, side]`, nonzero for an obstacle.
    pub obstacles: &'a [f32],
    /// Side of the window.
    pub side: usize,
}

/// One agent that walks a shortest path over the obstacles it has seen so far.
///
/// After a step that did not move it, it acts at random until it moves again.
///
/// Rule: policy/astar
pub struct AStarAgent {
    obstacles: HashSet<Place>,
    last: Option<Place>,
    random_action: Box<dyn FnMut() -> Action + Send>,
}

impl AStarAgent {
    /// An agent that knows nothing yet, with its own source of random actions.
    pub fn new(random_action: Box<dyn FnMut() -> Action + Send>) -> Self {
        Self { obstacles: HashSet::new(), last: None, random_action }
    }

    /// Chooses an action.
    ///
    /// # Errors
    /// [`Error::State`] if the agent is further than one step from where it last planned.
    ///
    /// Rule: policy/astar
    pub fn act(&mut self, view: View<'_>) -> Result<Action, Error> {
        let [row, col] = view.cell;
        let (cell, goal) = ((row, col), (view.goal[0], view.goal[1]));
        if let Some(last) = self.last {
            match distance(last, cell) {
                0 if cell != goal => return Ok((self.random_action)()),
                0 | 1 => {}
                _ => {
                    return Err(Error::State {
                        reason: "the A* agent jumped; a new episode needs a new agent".into(),
                    });
                }
            }
        }
        self.look(cell, &view);
        self.last = Some(cell);
        Ok(first_move(cell, goal, &self.obstacles))
    }

    /// Forgets what it has seen and where it was, for a new episode.
    pub fn forget(&mut self) {
        self.obstacles.clear();
        self.last = None;
    }

    /// Overwrites what it knows of the cells it sees now; other agents are no obstacles to it.
    fn look(&mut self, (row, col): Place, view: &View<'_>) {
        let radius = view.side as i32 / 2;
        for (line, values) in view.obstacles.chunks(view.side).enumerate() {
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

/// One [`AStarAgent`] for each agent of an environment.
///
/// Rule: policy/astar
pub struct AStarTeam {
    agents: Vec<AStarAgent>,
    make_random: Box<dyn Fn() -> Box<dyn FnMut() -> Action + Send> + Send>,
}

impl AStarTeam {
    /// A team; `make_random` makes each agent's source of random actions, in POGEMA the same one for all.
    pub fn new(make_random: Box<dyn Fn() -> Box<dyn FnMut() -> Action + Send> + Send>) -> Self {
        Self { agents: Vec::new(), make_random }
    }

    /// Forgets everything, for a new episode.
    pub fn reset(&mut self) {
        self.agents.clear();
    }

    /// Chooses an action for each agent.
    ///
    /// # Errors
    /// As [`AStarAgent::act`].
    pub fn act<'a>(&mut self, views: impl IntoIterator<Item = View<'a>>) -> Result<Vec<Action>, Error> {
        let mut actions = Vec::new();
        for (index, view) in views.into_iter().enumerate() {
            if index == self.agents.len() {
                self.agents.push(AStarAgent::new((self.make_random)()));
            }
            actions.push(self.agents[index].act(view)?);
        }
        Ok(actions)
    }
}

impl std::fmt::Debug for AStarTeam {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("AStarTeam").field("agents", &self.agents).finish_non_exhaustive()
    }
}

#[derive(Clone, Copy, Debug)]
struct Node {
    place: Place,
    cost: i32,
    estimate: i32,
}

/// POGEMA's comparison: by estimated length, then the *shorter* walked part, then one that is no order.
fn is_before(one: &Node, other: &Node) -> bool {
    if one.estimate != other.estimate {
        return one.estimate < other.estimate;
    }
    if one.cost != other.cost {
        return one.cost < other.cost;
    }
    one.place.0 < other.place.0 || one.place.1 < other.place.1
}

fn distance(one: Place, other: Place) -> i32 {
    (one.0 - other.0).abs() + (one.1 - other.1).abs()
}

/// The first move of the path found, or a wait if there is none.
fn first_move(start: Place, goal: Place, obstacles: &HashSet<Place>) -> Action {
    let came_by = search(start, goal, obstacles);
    let mut at = goal;
    let mut action = Action::Stay;
    while let Some(&Some((from, step))) = came_by.get(&at) {
        (at, action) = (from, step);
    }
    action
}

/// From where, and by which move, each place was first reached.
fn search(start: Place, goal: Place, obstacles: &HashSet<Place>) -> HashMap<Place, Option<(Place, Action)>> {
    let mut came_by = HashMap::from([(start, None)]);
    let mut open = Heap::new(is_before);
    open.push(Node { place: start, cost: 0, estimate: distance(start, goal) });
    for _ in 0..MOST_EXPANSIONS {
        let Some(node) = open.pop() else { break };
        for action in [Action::Up, Action::Down, Action::Left, Action::Right] {
            let (down, right) = action.delta();
            let place = (node.place.0 + down, node.place.1 + right);
            if obstacles.contains(&place) || came_by.contains_key(&place) {
                continue;
            }
            came_by.insert(place, Some((node.place, action)));
            let cost = node.cost + 1;
            open.push(Node { place, cost, estimate: cost + distance(place, goal) });
        }
        if node.place == goal || open.is_empty() {
            break;
        }
    }
    came_by
}
