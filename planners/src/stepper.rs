//! PIBT: one step for everybody, decided agent by agent, each pushing away who stands where it wants to go.
//!
//! Papers: Okumura, Machida, Défago, Tamura, "Priority Inheritance with Backtracking for Iterative Multi-agent Path
//! Finding", AIJ 2022; the swap of agents in a corridor: Okumura, "Improving LaCAM for Scalable Eventually Optimal
//! Multi-Agent Pathfinding", IJCAI 2023; ties by who would be hindered: Okumura, Nagai, "Lightweight and Effective
//! Preference Construction in PIBT", 2025.
//!
//! | here | there |
//! | --- | --- |
//! | `now`, `next` | Q from, Q to: the configuration before and after the step |
//! | `Frame::places` | C: where an agent would go, best first |
//! | `costs` | dist: steps to the goal, others left out |
//! | `pusher`, `puller` | the agents of a swap: who wants to pass, and who must come along to where there is room |

use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::graph::{Graph, Vertex};
use crate::scatter::Hints;

/// The number of an agent.
pub(crate) type Agent = u32;

/// No agent, or no vertex yet.
const NONE: u32 = u32::MAX;

/// The lower bits of an agent's patience never change and differ from agent to agent; the upper ones count the steps
/// for which it has not been at its goal.
const RANK: u32 = 0xf_ffff;

/// The patience of agents at the start: one has the more of it, the more it costs to get to its goal.
pub(crate) fn patience_by(num_agents: usize, cost: impl Fn(Agent) -> u32) -> Vec<u32> {
    let mut ranks: Vec<Agent> = (0..num_agents as Agent).collect();
    ranks.sort_by_key(|&agent| cost(agent));
    let mut patience = vec![0; num_agents];
    for (rank, &agent) in ranks.iter().enumerate() {
        patience[agent as usize] = rank as u32;
    }
    patience
}

/// The patience of an agent after a step.
pub(crate) fn patience_after(patience: u32, is_there: bool) -> u32 {
    match patience.checked_add(RANK + 1) {
        _ if is_there => patience & RANK,
        Some(more) => more,
        // Nobody waits longer than it can count, and all who do keep their ranks.
        None => patience,
    }
}

/// Puts first who has waited longest.
pub(crate) fn sort_by_patience(order: &mut [Agent], patience: &[u32]) {
    order.sort_unstable_by_key(|&agent| (std::cmp::Reverse(patience[agent as usize]), agent));
}

/// How PIBT chooses among the places an agent may go to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PibtRules {
    /// Whether two agents that block each other in a corridor go to where they can pass.
    pub swap: bool,
    /// Whether an agent prefers, among equally good places, the one that fewer others want.
    pub hindrance: bool,
}

impl Default for PibtRules {
    fn default() -> Self {
        Self { swap: true, hindrance: true }
    }
}

/// What it costs an agent to go on from a vertex.
pub(crate) trait Costs {
    fn cost(&self, vertex: Vertex) -> u32;
}

impl<T: AsRef<[u32]>> Costs for T {
    fn cost(&self, vertex: Vertex) -> u32 {
        self.as_ref()[vertex as usize]
    }
}

/// What a step is decided from: configuration, goals, costs to go and who chooses first.
#[derive(Debug)]
pub(crate) struct Scene<'a, C> {
    pub graph: &'a Graph,
    pub now: &'a [Vertex],
    pub goals: &'a [Vertex],
    pub costs: &'a [C],
    /// All agents, the first choosing first.
    pub order: &'a [Agent],
    /// Where agents go rather than where it costs least.
    pub hints: &'a Hints,
}

impl<C: Costs> Scene<'_, C> {
    fn cost(&self, agent: Agent, vertex: Vertex) -> u32 {
        self.costs[agent as usize].cost(vertex)
    }

    fn place(&self, agent: Agent) -> Vertex {
        self.now[agent as usize]
    }
}

/// An agent whose place is being decided.
#[derive(Clone, Copy, Debug)]
struct Frame {
    agent: Agent,
    places: [Vertex; 5],
    num_places: u8,
    tried: u8,
    /// Who is to follow into the place left behind.
    follower: Agent,
}

/// Decides steps, and keeps the room that takes; it allocates nothing once it has seen as many agents.
#[derive(Debug)]
pub(crate) struct Stepper {
    rules: PibtRules,
    random: Pcg64Mcg,
    /// For each vertex, who is there before and after the step.
    standing: Vec<Agent>,
    taken: Vec<Agent>,
    next: Vec<Vertex>,
    stack: Vec<Frame>,
}

impl Stepper {
    /// For a graph, with ties broken by a seed.
    pub fn new(graph: &Graph, rules: PibtRules, seed: u64) -> Self {
        let nobody = vec![NONE; graph.num_vertices()];
        let random = Pcg64Mcg::seed_from_u64(seed);
        Self { rules, random, standing: nobody.clone(), taken: nobody, next: Vec::new(), stack: Vec::new() }
    }

    /// The configuration after the step, in which forced agents are where they have to be; none if PIBT finds none,
    /// which happens only if somebody is forced.
    pub fn step<C: Costs>(&mut self, scene: &Scene<'_, C>, forced: &[(Agent, Vertex)]) -> Option<&[Vertex]> {
        self.next.clear();
        self.next.resize(scene.now.len(), NONE);
        for (agent, &vertex) in scene.now.iter().enumerate() {
            self.standing[vertex as usize] = agent as Agent;
        }
        let found = forced.iter().all(|&(agent, vertex)| self.force(scene, agent, vertex))
            && scene.order.iter().all(|&agent| self.is_decided(agent) || self.decide(scene, agent));
        // Whoever stepped aside for nothing is where it was; places taken on the way are all next ones or old ones.
        for (&before, &after) in scene.now.iter().zip(&self.next) {
            self.standing[before as usize] = NONE;
            self.taken[before as usize] = NONE;
            if after != NONE {
                self.taken[after as usize] = NONE;
            }
        }
        found.then_some(&self.next[..])
    }

    /// An agent that is in one place with another.
    pub fn shared_place(&mut self, now: &[Vertex]) -> Option<usize> {
        let stands = |(agent, &vertex): (usize, &Vertex)| {
            (std::mem::replace(&mut self.standing[vertex as usize], agent as Agent) != NONE).then_some(agent)
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

    fn force<C: Costs>(&mut self, scene: &Scene<'_, C>, agent: Agent, vertex: Vertex) -> bool {
        let is_free = self.taken[vertex as usize] == NONE && !self.would_exchange(scene, agent, vertex);
        if is_free {
            self.take(agent, vertex);
        }
        is_free
    }

    fn take(&mut self, agent: Agent, vertex: Vertex) {
        self.taken[vertex as usize] = agent;
        self.next[agent as usize] = vertex;
    }

    /// Whether who stands at a vertex goes to where the agent is.
    fn would_exchange<C: Costs>(&self, scene: &Scene<'_, C>, agent: Agent, vertex: Vertex) -> bool {
        let other = self.standing[vertex as usize];
        other != NONE && other != agent && self.next[other as usize] == scene.place(agent)
    }

    /// Decides where an agent goes, and all whom it pushes; whether that was possible.
    fn decide<C: Costs>(&mut self, scene: &Scene<'_, C>, agent: Agent) -> bool {
        let first = self.frame(scene, agent);
        self.stack.clear();
        self.stack.push(first);
        // What became of the last pushed agent: whether it got away.
        let mut answer = None;
        while let Some(mut frame) = self.stack.pop() {
            if answer == Some(true) {
                self.pull(scene, &frame);
                continue;
            }
            answer = match self.try_next(scene, &mut frame) {
                Try::Moved => {
                    self.pull(scene, &frame);
                    Some(true)
                }
                Try::Pushed(other) => {
                    self.stack.push(frame);
                    let pushed = self.frame(scene, other);
                    self.stack.push(pushed);
                    None
                }
                Try::Stuck => {
                    self.take(frame.agent, scene.place(frame.agent));
                    Some(false)
                }
            };
        }
        answer == Some(true)
    }

    /// Takes the next place that is free.
    fn try_next<C: Costs>(&mut self, scene: &Scene<'_, C>, frame: &mut Frame) -> Try {
        while frame.tried < frame.num_places {
            let vertex = frame.places[usize::from(frame.tried)];
            frame.tried += 1;
            if self.taken[vertex as usize] != NONE || self.would_exchange(scene, frame.agent, vertex) {
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

    /// Lets the follower of an agent that got its best place follow.
    fn pull<C: Costs>(&mut self, scene: &Scene<'_, C>, frame: &Frame) {
        let left = scene.place(frame.agent);
        if frame.follower != NONE
            && frame.tried == 1
            && !self.is_decided(frame.follower)
            && self.taken[left as usize] == NONE
        {
            self.take(frame.follower, left);
        }
    }

    /// Where an agent would go, best first.
    fn frame<C: Costs>(&mut self, scene: &Scene<'_, C>, agent: Agent) -> Frame {
        let here = scene.place(agent);
        let around = scene.graph.neighbours(here);
        let hint = scene.hints.next(agent, here);
        let mut dice = self.random.next_u64();
        let mut keyed = [(u64::MAX, here); 5];
        for (slot, &vertex) in keyed.iter_mut().zip(around.iter().chain([&here])) {
            dice >>= 8;
            let hindered = if self.rules.hindrance {
                self.hindered(scene, agent, vertex)
            } else {
                u64::from(vertex == here)
            };
            let cost = if hint == Some(vertex) { 0 } else { u64::from(scene.cost(agent, vertex)) + 1 };
            *slot = (cost << 16 | hindered << 8 | dice & 0xff, vertex);
        }
        let num_places = around.len() + 1;
        sort_few(&mut keyed[..num_places]);
        let mut places = keyed.map(|(_, vertex)| vertex);
        let follower = if self.rules.swap { self.partner(scene, agent, places[0]) } else { NONE };
        if follower != NONE {
            places[..num_places].reverse();
        }
        Frame { agent, places, num_places: num_places as u8, tried: 0, follower }
    }

    /// How many others around a vertex want to go there.
    fn hindered<C: Costs>(&self, scene: &Scene<'_, C>, agent: Agent, vertex: Vertex) -> u64 {
        let wants = |&&place: &&Vertex| {
            let other = self.standing[place as usize];
            other != NONE && other != agent && scene.cost(other, vertex) < scene.cost(other, place)
        };
        scene.graph.neighbours(vertex).iter().filter(wants).count() as u64
    }

    /// Who has to be led away, the agent going first, so that the two can pass each other.
    fn partner<C: Costs>(&self, scene: &Scene<'_, C>, agent: Agent, best: Vertex) -> Agent {
        let here = scene.place(agent);
        if best == here {
            return NONE;
        }
        let ahead = self.standing[best as usize];
        if ahead != NONE
            && !self.is_decided(ahead)
            && self.must_swap(scene, agent, ahead, here, best)
            && self.can_swap(scene, best, here)
        {
            return ahead;
        }
        self.pusher_behind(scene, agent, best)
    }

    /// Who stands beside the agent and can pass it only once the agent has made room.
    fn pusher_behind<C: Costs>(&self, scene: &Scene<'_, C>, agent: Agent, best: Vertex) -> Agent {
        let here = scene.place(agent);
        let is_pusher = |&place: &Vertex| {
            let other = self.standing[place as usize];
            other != NONE
                && place != best
                && self.must_swap(scene, other, agent, here, best)
                && self.can_swap(scene, best, here)
        };
        let found = scene.graph.neighbours(here).iter().copied().find(is_pusher);
        found.map_or(NONE, |place| self.standing[place as usize])
    }

    /// Whether the pusher, going on behind the puller, meets no place to pass before one of them must turn.
    fn must_swap<C: Costs>(
        &self,
        scene: &Scene<'_, C>,
        pusher: Agent,
        puller: Agent,
        mut behind: Vertex,
        mut ahead: Vertex,
    ) -> bool {
        while scene.cost(pusher, ahead) < scene.cost(pusher, behind) {
            match self.way_on(scene, behind, ahead) {
                Way::Fork => return false,
                Way::End => break,
                Way::Only(next) => (behind, ahead) = (ahead, next),
            }
        }
        scene.cost(puller, behind) < scene.cost(puller, ahead)
            && (scene.cost(pusher, behind) == 0 || scene.cost(pusher, ahead) < scene.cost(pusher, behind))
    }

    /// Whether the puller, walking away from the pusher, comes to a fork.
    fn can_swap<C: Costs>(&self, scene: &Scene<'_, C>, pusher: Vertex, puller: Vertex) -> bool {
        let (mut behind, mut ahead) = (pusher, puller);
        loop {
            match self.way_on(scene, behind, ahead) {
                Way::Fork => return true,
                Way::End => return false,
                Way::Only(next) => (behind, ahead) = (ahead, next),
            }
            if ahead == pusher {
                return false;
            }
        }
    }

    /// How a corridor goes on; a dead end whose agent has arrived there does not count.
    fn way_on<C: Costs>(&self, scene: &Scene<'_, C>, behind: Vertex, ahead: Vertex) -> Way {
        let mut way = Way::End;
        for &vertex in scene.graph.neighbours(ahead) {
            let agent = self.standing[vertex as usize];
            let is_closed = scene.graph.neighbours(vertex).len() == 1
                && agent != NONE
                && scene.goals[agent as usize] == vertex;
            if vertex == behind || is_closed {
                continue;
            }
            match way {
                Way::End => way = Way::Only(vertex),
                _ => return Way::Fork,
            }
        }
        way
    }
}

/// What came of trying a place.
enum Try {
    Moved,
    Pushed(Agent),
    Stuck,
}

/// How a corridor goes on.
enum Way {
    End,
    Only(Vertex),
    Fork,
}

/// Sorts at most five by insertion.
fn sort_few(keyed: &mut [(u64, Vertex)]) {
    for end in 1..keyed.len() {
        let mut at = end;
        while at > 0 && keyed[at - 1].0 > keyed[at].0 {
            keyed.swap(at - 1, at);
            at -= 1;
        }
    }
}
