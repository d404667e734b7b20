//! Which agents to plan anew together.
//!
//! Papers: Li, Chen, Harabor, Stuckey, Koenig, "Anytime Multi-Agent Path Finding via Large Neighborhood Search",
//! IJCAI 2021: agents that delay one, agents that meet near a place, agents at random, and which of the three shall be
//! chosen more often.

use rand_core::Rng;
use rand_pcg::Pcg64Mcg;

use crate::graph::Vertex;
use crate::random::below;
use crate::refine::team::Team;
use crate::stepper::Agent;

/// How agents are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// One that is late, and those in its way.
    Delay,
    /// Those that come by a place at about the same time.
    Region,
    /// Anybody.
    Random,
}

const KINDS: [Kind; 3] = [Kind::Delay, Kind::Region, Kind::Random];

/// Numbers of agents planned anew together.
const SIZES: [usize; 5] = [2, 4, 8, 12, 20];

/// How fast weights follow what they reward.
const REACTION: f64 = 0.02;

/// No way of choosing is weighted less than this part of the best.
const LEAST: f64 = 0.05;

/// Chooses, and learns which ways of choosing pay.
#[derive(Debug)]
pub(crate) struct Choice {
    weights: [f64; KINDS.len() * SIZES.len()],
    last: usize,
    agents: Vec<Agent>,
    /// For each agent, the round in which it was last chosen.
    chosen: Vec<u32>,
    round: u32,
    queue: Vec<Vertex>,
    /// For each vertex, the round in which it was last looked at.
    seen: Vec<u32>,
}

impl Choice {
    /// For so many agents on so many vertices.
    pub fn new(num_agents: usize, num_vertices: usize) -> Self {
        Self {
            weights: [1.0; KINDS.len() * SIZES.len()],
            last: 0,
            agents: Vec::new(),
            chosen: vec![0; num_agents],
            round: 0,
            queue: Vec::new(),
            seen: vec![0; num_vertices],
        }
    }

    /// Agents to be planned anew.
    pub fn choose(&mut self, team: &Team<'_>, random: &mut Pcg64Mcg) -> &[Agent] {
        self.round = self.round.wrapping_add(1);
        self.agents.clear();
        self.last = self.draw(random);
        let size = SIZES[self.last % SIZES.len()].min(team.num_agents());
        match KINDS[self.last / SIZES.len()] {
            Kind::Delay => self.choose_by_delay(team, random, size),
            Kind::Region => self.choose_by_region(team, random, size),
            Kind::Random => {
                self.add(late_agent(team, random));
                self.fill_up(team, random, size);
            }
        }
        &self.agents
    }

    /// Learns what the last choice brought, in steps for the work of a thousand labels.
    pub fn reward(&mut self, gain: f64) {
        let weight = &mut self.weights[self.last];
        *weight += REACTION * (gain - *weight);
    }

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
        let chosen = &mut self.chosen[agent as usize];
        if *chosen != self.round {
            *chosen = self.round;
            self.agents.push(agent);
        }
    }

    fn fill_up(&mut self, team: &Team<'_>, random: &mut Pcg64Mcg, size: usize) {
        for _ in 0..4 * size {
            if self.agents.len() >= size {
                return;
            }
            self.add(below(random, team.num_agents()) as Agent);
        }
    }

    fn choose_by_delay(&mut self, team: &Team<'_>, random: &mut Pcg64Mcg, size: usize) {
        let mut agent = late_agent(team, random);
        self.add(agent);
        for _ in 0..10 {
            self.walk(team, random, agent, size);
            if self.agents.len() >= size {
                return;
            }
            agent = self.agents[below(random, self.agents.len())];
        }
    }

    /// From somewhere on an agent's path, walks where it would arrive earlier, and adds whom it meets.
    fn walk(&mut self, team: &Team<'_>, random: &mut Pcg64Mcg, agent: Agent, size: usize) {
        let (graph, costs) = (team.graph(), team.costs(agent));
        let path = team.path(agent);
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
            for other in [team.agent_at(next, time + 1), team.exchanged(place, next, time + 1)] {
                if let Some(other) = other.filter(|&other| other != agent) {
                    self.add(other);
                }
            }
            (place, time) = (next, time + 1);
        }
    }

    /// From somewhere on a late agent's path, adds who comes by, farther and farther around.
    fn choose_by_region(&mut self, team: &Team<'_>, random: &mut Pcg64Mcg, size: usize) {
        let agent = late_agent(team, random);
        self.add(agent);
        let path = team.path(agent);
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
            for time in first..=last.min(team.span() - 1) {
                if let Some(other) = team.agent_at(place, time).filter(|_| self.agents.len() < size) {
                    self.add(other);
                }
            }
            for &vertex in team.graph().neighbours(place) {
                if std::mem::replace(&mut self.seen[vertex as usize], self.round) != self.round {
                    self.queue.push(vertex);
                }
            }
        }
    }
}

/// An agent by lot, the later the more likely.
fn late_agent(team: &Team<'_>, random: &mut Pcg64Mcg) -> Agent {
    let agents = 0..team.num_agents() as Agent;
    let mut left = below(random, team.total_delay().max(1) as usize) as u64;
    for agent in agents {
        let delay = team.delay(agent);
        if left < delay {
            return agent;
        }
        left -= delay;
    }
    below(random, team.num_agents()) as Agent
}
