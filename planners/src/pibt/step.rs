//! The step of PIBT: agents choose in order of priority, and push other agents off the vertices they choose.
//!
//! Papers: Okumura, Machida, Défago, Tamura, "Priority Inheritance with Backtracking for Iterative Multi-agent Path
//! Finding", AIJ 2022; tie-breaking by hindrance: Okumura, Nagai, "Lightweight and Effective Preference Construction in
//! PIBT", 2025.
//!
//! | paper | here |
//! | --- | --- |
//! | Q from, Q to | `now`, `next`: the configurations before and after the step |
//! | C | [`Frame::places`]: the candidate vertices in the order of attempts |
//! | dist | `costs` |

use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::graph::{Graph, Vertex};
use crate::pibt::input::{Costs, NONE, StepInput};
use crate::pibt::swap::Swap;
use crate::problem::Agent;

/// Options of a PIBT step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PibtRules {
    /// Whether two agents that block each other in a corridor move to a place where they can swap.
    pub swap: bool,
    /// Whether an agent breaks ties in favour of the vertex where it hinders fewer agents.
    pub hindrance: bool,
}

impl Default for PibtRules {
    fn default() -> Self {
        Self { swap: true, hindrance: true }
    }
}

/// An agent whose move is being decided.
#[derive(Clone, Copy, Debug)]
struct Frame {
    agent: Agent,
    places: [Vertex; 5],
    num_places: u8,
    tried: u8,
    /// The agent that is pulled into the vertex left behind.
    follower: Agent,
}

/// The PIBT step. It reuses its memory and allocates only if the number of agents grows.
#[derive(Debug)]
pub(crate) struct PibtStep {
    rules: PibtRules,
    random: Pcg64Mcg,
    /// For each vertex, the agent there before the step.
    standing: Vec<Agent>,
    /// For each vertex, the agent there after the step.
    taken: Vec<Agent>,
    next: Vec<Vertex>,
    stack: Vec<Frame>,
}

impl PibtStep {
    /// Prepares steps on a graph; the seed breaks ties.
    pub fn new(graph: &Graph, rules: PibtRules, seed: u64) -> Self {
        let empty = vec![NONE; graph.num_vertices()];
        let random = Pcg64Mcg::seed_from_u64(seed);
        Self { rules, random, standing: empty.clone(), taken: empty, next: Vec::new(), stack: Vec::new() }
    }

    /// Returns the next configuration, which satisfies the constraints. PIBT fails only under constraints.
    pub fn run<C: Costs>(
        &mut self,
        input: &StepInput<'_, C>,
        constraints: &[(Agent, Vertex)],
    ) -> Option<&[Vertex]> {
        self.next.clear();
        self.next.resize(input.now.len(), NONE);
        for (agent, &vertex) in input.now.iter().enumerate() {
            self.standing[vertex as usize] = agent as Agent;
        }
        let found = constraints.iter().all(|&(agent, vertex)| self.constrain(input, agent, vertex))
            && input.order.iter().all(|&agent| self.is_decided(agent) || self.decide(input, agent));
        // Every taken vertex is the old or the new vertex of some agent.
        for (&before, &after) in input.now.iter().zip(&self.next) {
            self.standing[before as usize] = NONE;
            self.taken[before as usize] = NONE;
            if after != NONE {
                self.taken[after as usize] = NONE;
            }
        }
        found.then_some(&self.next[..])
    }

    /// Returns the first agent that shares its vertex with an earlier agent, and that earlier agent.
    pub fn find_shared_vertex(&mut self, now: &[Vertex]) -> Option<(usize, usize)> {
        let stands = |(agent, &vertex): (usize, &Vertex)| {
            let other = std::mem::replace(&mut self.standing[vertex as usize], agent as Agent);
            (other != NONE).then_some((agent, other as usize))
        };
        let found = now.iter().enumerate().find_map(stands);
        for &vertex in now {
            self.standing[vertex as usize] = NONE;
        }
        found
    }

    fn is_decided(&self, agent: Agent) -> bool {
        self.next[agent as usize] != NONE
    }

    fn constrain<C: Costs>(&mut self, input: &StepInput<'_, C>, agent: Agent, vertex: Vertex) -> bool {
        let is_free = self.taken[vertex as usize] == NONE && !self.would_swap(input, agent, vertex);
        if is_free {
            self.take(agent, vertex);
        }
        is_free
    }

    fn take(&mut self, agent: Agent, vertex: Vertex) {
        self.taken[vertex as usize] = agent;
        self.next[agent as usize] = vertex;
    }

    /// Returns whether the agent on a vertex moves to the vertex of this agent.
    fn would_swap<C: Costs>(&self, input: &StepInput<'_, C>, agent: Agent, vertex: Vertex) -> bool {
        let other = self.standing[vertex as usize];
        other != NONE && other != agent && self.next[other as usize] == input.place(agent)
    }

    /// Decides the move of an agent and of all agents it pushes; returns whether it could move.
    fn decide<C: Costs>(&mut self, input: &StepInput<'_, C>, agent: Agent) -> bool {
        let first = self.frame(input, agent);
        self.stack.clear();
        self.stack.push(first);
        // Whether the agent that was pushed last could move.
        let mut answer = None;
        while let Some(mut frame) = self.stack.pop() {
            if answer == Some(true) {
                self.pull(input, &frame);
                continue;
            }
            answer = match self.try_next(input, &mut frame) {
                Try::Moved => {
                    self.pull(input, &frame);
                    Some(true)
                }
                Try::Pushed(other) => {
                    self.stack.push(frame);
                    let pushed = self.frame(input, other);
                    self.stack.push(pushed);
                    None
                }
                Try::Stuck => {
                    self.take(frame.agent, input.place(frame.agent));
                    Some(false)
                }
            };
        }
        answer == Some(true)
    }

    /// Takes the next candidate vertex that is free.
    fn try_next<C: Costs>(&mut self, input: &StepInput<'_, C>, frame: &mut Frame) -> Try {
        while frame.tried < frame.num_places {
            let vertex = frame.places[usize::from(frame.tried)];
            frame.tried += 1;
            if self.taken[vertex as usize] != NONE || self.would_swap(input, frame.agent, vertex) {
                continue;
            }
            self.take(frame.agent, vertex);
            let other = self.standing[vertex as usize];
            if other != NONE && other != frame.agent && !self.is_decided(other) {
                return Try::Pushed(other);
            }
            return Try::Moved;
        }
        Try::Stuck
    }

    /// Pulls the follower of an agent that got its first candidate vertex.
    fn pull<C: Costs>(&mut self, input: &StepInput<'_, C>, frame: &Frame) {
        let left = input.place(frame.agent);
        if frame.follower != NONE
            && frame.tried == 1
            && !self.is_decided(frame.follower)
            && self.taken[left as usize] == NONE
        {
            self.take(frame.follower, left);
        }
    }

    /// Collects the candidate vertices of an agent, best first; with a follower, in reverse order.
    fn frame<C: Costs>(&mut self, input: &StepInput<'_, C>, agent: Agent) -> Frame {
        let here = input.place(agent);
        let around = input.graph.neighbours(here);
        let mut dice = self.random.next_u64();
        let mut keyed = [(u64::MAX, here); 5];
        for (slot, &vertex) in keyed.iter_mut().zip(around.iter().chain([&here])) {
            dice >>= 8;
            let hindered = if self.rules.hindrance {
                self.num_hindered(input, agent, vertex)
            } else {
                u64::from(vertex == here)
            };
            let cost = u64::from(input.cost(agent, vertex));
            *slot = (cost << 16 | hindered << 8 | dice & 0xff, vertex);
        }
        let num_places = around.len() + 1;
        sort_few(&mut keyed[..num_places]);
        let mut places = keyed.map(|(_, vertex)| vertex);
        let swap = Swap { input, standing: &self.standing, next: &self.next };
        let follower = if self.rules.swap { swap.partner(agent, places[0]) } else { NONE };
        if follower != NONE {
            places[..num_places].reverse();
        }
        Frame { agent, places, num_places: num_places as u8, tried: 0, follower }
    }

    /// Returns how many other agents next to a vertex would come closer to their goals if they moved to that vertex.
    fn num_hindered<C: Costs>(&self, input: &StepInput<'_, C>, agent: Agent, vertex: Vertex) -> u64 {
        let would_approach = |&&place: &&Vertex| {
            let other = self.standing[place as usize];
            other != NONE && other != agent && input.cost(other, vertex) < input.cost(other, place)
        };
        input.graph.neighbours(vertex).iter().filter(would_approach).count() as u64
    }
}

/// The result of trying the next candidate vertex.
enum Try {
    Moved,
    Pushed(Agent),
    Stuck,
}

/// Sorts at most five candidates by insertion.
fn sort_few(keyed: &mut [(u64, Vertex)]) {
    for end in 1..keyed.len() {
        let mut at = end;
        while at > 0 && keyed[at - 1].0 > keyed[at].0 {
            keyed.swap(at - 1, at);
            at -= 1;
        }
    }
}
