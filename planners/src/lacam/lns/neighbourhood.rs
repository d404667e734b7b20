//! The destroy heuristics, which select the agents to replan together.
//!
//! Papers: Li, Chen, Harabor, Stuckey, Koenig, "Anytime Multi-Agent Path Finding via Large Neighborhood Search",
//! IJCAI 2021: agent-based, map-based and random neighbourhoods, with adaptive weights.

use rand_core::Rng;
use rand_pcg::Pcg64Mcg;

use crate::graph::Vertex;
use crate::lacam::lns::solution::Solution;
use crate::problem::Agent;
use crate::random::below;

/// The destroy heuristics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Heuristic {
    /// A delayed agent, and the agents in its way.
    AgentBased,
    /// Agents that pass near a vertex at about the same time.
    MapBased,
    /// A delayed agent, and random others.
    Random,
}

const HEURISTICS: [Heuristic; 3] = [Heuristic::AgentBased, Heuristic::MapBased, Heuristic::Random];

/// The sizes of neighbourhoods.
const SIZES: [usize; 5] = [2, 4, 8, 12, 20];

/// The rate at which weights follow rewards.
const REACTION: f64 = 0.02;

/// The least weight, as a share of the highest one.
const LEAST: f64 = 0.05;

/// Selects neighbourhoods, and learns which heuristics and sizes pay off.
#[derive(Debug)]
pub(crate) struct NeighbourhoodSelector {
    weights: [f64; HEURISTICS.len() * SIZES.len()],
    last: usize,
    agents: Vec<Agent>,
    /// For each agent, the round in which it was last selected.
    selected: Vec<u32>,
    round: u32,
    queue: Vec<Vertex>,
    /// For each vertex, the round in which it was last visited.
    seen: Vec<u32>,
}

impl NeighbourhoodSelector {
    /// Creates a selector for a number of agents and vertices.
    pub fn new(num_agents: usize, num_vertices: usize) -> Self {
        Self {
            weights: [1.0; HEURISTICS.len() * SIZES.len()],
            last: 0,
            agents: Vec::new(),
            selected: vec![0; num_agents],
            round: 0,
            queue: Vec::new(),
            seen: vec![0; num_vertices],
        }
    }

    /// Selects the agents to replan.
    pub fn select(&mut self, solution: &Solution<'_>, random: &mut Pcg64Mcg) -> &[Agent] {
        self.round = self.round.wrapping_add(1);
        self.agents.clear();
        self.last = self.draw(random);
        let size = SIZES[self.last % SIZES.len()].min(solution.num_agents());
        match HEURISTICS[self.last / SIZES.len()] {
            Heuristic::AgentBased => self.select_agent_based(solution, random, size),
            Heuristic::MapBased => self.select_map_based(solution, random, size),
            Heuristic::Random => {
                self.add(delayed_agent(solution, random));
                self.fill_up(solution, random, size);
            }
        }
        &self.agents
    }

    /// Rewards the last selection. Units: steps gained per thousand expanded labels.
    pub fn reward(&mut self, gain: f64) {
        let weight = &mut self.weights[self.last];
        *weight += REACTION * (gain - *weight);
    }

    /// Draws a heuristic and a size by weight.
    fn draw(&self, random: &mut Pcg64Mcg) -> usize {
        let best = self.weights.iter().copied().fold(0.0, f64::max);
        let floor = (best * LEAST).max(f64::MIN_POSITIVE);
        let total: f64 = self.weights.iter().map(|weight| weight.max(floor)).sum();
        let mut left = f64::from(random.next_u32()) / f64::from(u32::MAX) * total;
        for (arm, weight) in self.weights.iter().enumerate() {
            left -= weight.max(floor);
            if left <= 0.0 {
                return arm;
            }
        }
        0
    }

    fn add(&mut self, agent: Agent) {
        let selected = &mut self.selected[agent as usize];
        if *selected != self.round {
            *selected = self.round;
            self.agents.push(agent);
        }
    }

    /// Adds random agents.
    fn fill_up(&mut self, solution: &Solution<'_>, random: &mut Pcg64Mcg, size: usize) {
        for _ in 0..4 * size {
            if self.agents.len() >= size {
                return;
            }
            self.add(below(random, solution.num_agents()) as Agent);
        }
    }

    fn select_agent_based(&mut self, solution: &Solution<'_>, random: &mut Pcg64Mcg, size: usize) {
        let mut agent = delayed_agent(solution, random);
        self.add(agent);
        for _ in 0..10 {
            self.walk(solution, random, agent, size);
            if self.agents.len() >= size {
                return;
            }
            agent = self.agents[below(random, self.agents.len())];
        }
    }

    /// Walks from a random step of an agent's path, and adds the other agents that it meets.
    ///
    /// The walk visits only vertices from which the agent could arrive earlier than its path does.
    fn walk(&mut self, solution: &Solution<'_>, random: &mut Pcg64Mcg, agent: Agent, size: usize) {
        let (graph, costs) = (solution.graph(), solution.costs(agent));
        let path = solution.path(agent);
        let arrival = path.len() as u32 - 1;
        let mut time = below(random, path.len()) as u32;
        let mut place = path[time as usize];
        while self.agents.len() < size && time < arrival {
            let around = graph.neighbours(place);
            let turn = below(random, around.len() + 1);
            let choices = (0..=around.len()).map(|slot| (slot + turn) % (around.len() + 1));
            let mut steps = choices.map(|slot| around.get(slot).copied().unwrap_or(place));
            let Some(next) = steps.find(|&next| time + 1 + costs[next as usize] < arrival) else {
                return;
            };
            for other in [solution.agent_at(next, time + 1), solution.swapping(place, next, time + 1)] {
                if let Some(other) = other.filter(|&other| other != agent) {
                    self.add(other);
                }
            }
            (place, time) = (next, time + 1);
        }
    }

    /// Adds a delayed agent and the agents that pass near a random step of its path, the nearest first.
    fn select_map_based(&mut self, solution: &Solution<'_>, random: &mut Pcg64Mcg, size: usize) {
        let agent = delayed_agent(solution, random);
        self.add(agent);
        let path = solution.path(agent);
        let time = below(random, path.len());
        let reach = 4 << below(random, 4);
        let (first, last) = (time.saturating_sub(reach) as u32, (time + reach) as u32);
        self.queue.clear();
        self.queue.push(path[time]);
        self.seen[path[time] as usize] = self.round;
        let mut next = 0;
        while self.agents.len() < size && next < self.queue.len() {
            let place = self.queue[next];
            next += 1;
            for time in first..=last.min(solution.span() - 1) {
                if let Some(other) = solution.agent_at(place, time).filter(|_| self.agents.len() < size) {
                    self.add(other);
                }
            }
            for &vertex in solution.graph().neighbours(place) {
                if std::mem::replace(&mut self.seen[vertex as usize], self.round) != self.round {
                    self.queue.push(vertex);
                }
            }
        }
    }
}

/// Draws an agent with probability proportional to its delay.
fn delayed_agent(solution: &Solution<'_>, random: &mut Pcg64Mcg) -> Agent {
    let agents = 0..solution.num_agents() as Agent;
    let mut left = below(random, solution.total_delay().max(1) as usize) as u64;
    for agent in agents {
        let delay = solution.delay(agent);
        if left < delay {
            return agent;
        }
        left -= delay;
    }
    below(random, solution.num_agents()) as Agent
}
