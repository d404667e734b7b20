//! The paths of all agents, and where two of them meet.

use std::ops::ControlFlow;
use std::sync::Arc;

use crate::distances::CostToGo;
use crate::graph::Vertex;
use crate::problem::{Outcome, Problem};
use crate::sipp::{Horizon, Leg};

/// What paths are wanted.
pub(crate) struct Setting<'a> {
    pub(crate) starts: &'a [Vertex],
    pub(crate) legs: &'a [Vec<Leg>],
    pub(crate) horizon: Horizon,
    pub(crate) salt: u32,
}

impl<'a> Setting<'a> {
    /// Paths that solve a problem.
    pub(crate) fn one_shot(problem: &'a Problem, legs: &'a [Vec<Leg>], seed: u64) -> Self {
        let at_most = problem.most_steps.map_or(u32::MAX, |most| u32::try_from(most).unwrap_or(u32::MAX));
        Self { starts: &problem.starts, legs, horizon: Horizon::Stay { at_most }, salt: seed as u32 }
    }

    /// Whether agents stay where their paths end.
    pub(crate) fn stays(&self) -> bool {
        matches!(self.horizon, Horizon::Stay { .. })
    }
}

/// The goals of a problem's agents, who have one each.
pub(crate) fn one_leg_each(costs: &[CostToGo]) -> Vec<Vec<Leg>> {
    costs.iter().map(|to_go| vec![Leg::last(to_go.clone())]).collect()
}

/// A path for each agent; nodes of a search share those that they have in common.
#[derive(Clone, Debug)]
pub(crate) struct Paths {
    each: Vec<Arc<Vec<Vertex>>>,
    costs: Vec<u32>,
    /// Whether agents stay where their paths end.
    pub(crate) stays: bool,
}

/// Two agents that meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Meeting {
    /// The lower one first.
    pub(crate) agents: (usize, usize),
    /// The step after which they meet, or in which they exchange their places.
    pub(crate) step: usize,
    /// Where the first agent comes from, if they exchange their places.
    pub(crate) from: Option<Vertex>,
    /// Where the first agent is then.
    pub(crate) at: Vertex,
}

impl Paths {
    pub(crate) fn new(num_agents: usize, stays: bool) -> Self {
        Self { each: vec![Arc::default(); num_agents], costs: vec![0; num_agents], stays }
    }

    pub(crate) fn num_agents(&self) -> usize {
        self.each.len()
    }

    pub(crate) fn path(&self, agent: usize) -> &[Vertex] {
        &self.each[agent]
    }

    pub(crate) fn cost(&self, agent: usize) -> u32 {
        self.costs[agent]
    }

    pub(crate) fn set(&mut self, agent: usize, path: Arc<Vec<Vertex>>, cost: u32) {
        self.each[agent] = path;
        self.costs[agent] = cost;
    }

    /// Gives an agent the path that another has elsewhere.
    pub(crate) fn take_from(&mut self, elsewhere: &Self, other: usize, agent: usize) {
        self.set(agent, elsewhere.each[other].clone(), elsewhere.costs[other]);
    }

    pub(crate) fn total_cost(&self) -> u64 {
        self.costs.iter().map(|&cost| u64::from(cost)).sum()
    }

    /// The longest path's number of steps.
    pub(crate) fn num_steps(&self) -> usize {
        self.each.iter().map(|path| path.len().saturating_sub(1)).max().unwrap_or(0)
    }

    /// Where an agent is after a step.
    pub(crate) fn at(&self, agent: usize, step: usize) -> Option<Vertex> {
        let path = &self.each[agent];
        let end = path.last().filter(|_| self.stays);
        path.get(step).or(end).copied()
    }

    /// The first meeting of two agents.
    pub(crate) fn meeting(&self, one: usize, other: usize) -> Option<Meeting> {
        let agents = (one.min(other), one.max(other));
        let last = self.each[one].len().max(self.each[other].len());
        (0..last).find_map(|step| self.meeting_at(agents, step))
    }

    /// The meeting of two agents at a step.
    pub(crate) fn meeting_at(&self, agents: (usize, usize), step: usize) -> Option<Meeting> {
        let at = self.at(agents.0, step)?;
        let there = self.at(agents.1, step)?;
        if at == there {
            return Some(Meeting { agents, step, from: None, at });
        }
        let before = step.checked_sub(1)?;
        let (from, from_there) = (self.at(agents.0, before)?, self.at(agents.1, before)?);
        (at == from_there && there == from).then_some(Meeting { agents, step, from: Some(from), at })
    }

    pub(crate) fn collide(&self, one: usize, other: usize) -> bool {
        self.meeting(one, other).is_some()
    }

    /// All paths step by step, as a solution of a problem.
    pub(crate) fn outcome(&self, problem: &Problem, lower_bound: u64) -> Outcome {
        let place = |agent: usize, step: usize| self.at(agent, step).unwrap_or(problem.goals[agent]);
        let places = |step: usize| (0..self.num_agents()).map(|agent| place(agent, step)).collect();
        let steps: Vec<Vec<Vertex>> = (0..=self.num_steps()).map(places).collect();
        match problem.plan(&steps) {
            Ok(plan) => Outcome::Solved { plan, lower_bound },
            Err(error) => Outcome::Impossible { reason: error.to_string() },
        }
    }
}

/// All meetings of all agents, the earliest first.
pub(crate) fn all_conflicts(paths: &Paths, num_vertices: usize) -> Vec<Meeting> {
    let mut found = Vec::new();
    let _ = for_each_meeting(paths, num_vertices, |meeting| {
        found.push(meeting);
        ControlFlow::Continue(())
    });
    found
}

/// The earliest meeting of all agents.
pub(crate) fn first_conflict(paths: &Paths, num_vertices: usize) -> Option<Meeting> {
    for_each_meeting(paths, num_vertices, ControlFlow::Break).break_value()
}

/// Goes through the meetings step by step until it is told to stop.
fn for_each_meeting(
    paths: &Paths,
    num_vertices: usize,
    mut visit: impl FnMut(Meeting) -> ControlFlow<Meeting>,
) -> ControlFlow<Meeting> {
    let agents = 0..paths.num_agents();
    let (mut before, mut now) =
        (Crowd::new(num_vertices, agents.len()), Crowd::new(num_vertices, agents.len()));
    for step in 0..=paths.num_steps() {
        for agent in agents.clone() {
            let Some(at) = paths.at(agent, step) else { continue };
            for other in now.at(at) {
                visit(Meeting { agents: (other, agent), step, from: None, at })?;
            }
            now.enter(agent, at);
            let Some(from) = step.checked_sub(1).and_then(|before| paths.at(agent, before)) else { continue };
            // Of those that leave for where this one comes from, the lower ones are known by now.
            for other in before.at(at).filter(|&other| other < agent && from != at) {
                if paths.at(other, step) == Some(from) {
                    visit(Meeting { agents: (other, agent), step, from: Some(at), at: from })?;
                }
            }
        }
        std::mem::swap(&mut before, &mut now);
        now.clear();
    }
    ControlFlow::Continue(())
}

/// Who is in each vertex at a step.
struct Crowd {
    /// For each vertex, who entered last.
    last: Vec<u32>,
    /// For each agent, who entered the same vertex before.
    earlier: Vec<u32>,
    taken: Vec<Vertex>,
}

impl Crowd {
    const NOBODY: u32 = u32::MAX;

    fn new(num_vertices: usize, num_agents: usize) -> Self {
        let nobody = |count| vec![Self::NOBODY; count];
        Self { last: nobody(num_vertices), earlier: nobody(num_agents), taken: Vec::new() }
    }

    fn enter(&mut self, agent: usize, at: Vertex) {
        self.earlier[agent] = std::mem::replace(&mut self.last[at as usize], agent as u32);
        self.taken.push(at);
    }

    fn at(&self, vertex: Vertex) -> impl Iterator<Item = usize> + '_ {
        let somebody = |agent: u32| (agent != Self::NOBODY).then_some(agent as usize);
        std::iter::successors(somebody(self.last[vertex as usize]), move |&agent| {
            somebody(self.earlier[agent])
        })
    }

    fn clear(&mut self) {
        for vertex in self.taken.drain(..) {
            self.last[vertex as usize] = Self::NOBODY;
        }
    }
}
