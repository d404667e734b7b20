//! The swap operation of PIBT, which lets two agents pass each other where a corridor forks.
//!
//! Source: Okumura, "Improving LaCAM for Scalable Eventually Optimal Multi-Agent Pathfinding", IJCAI 2023.
//!
//! | paper | meaning |
//! | --- | --- |
//! | pusher, puller | the agent that follows, and the agent that moves ahead of it |

use crate::graph::Vertex;
use crate::pibt::input::{Costs, NONE, StepInput};
use crate::problem::Agent;

/// The swap test in the middle of a step.
pub(super) struct Swap<'a, C> {
    pub input: &'a StepInput<'a, C>,
    /// For each vertex, the agent there before the step.
    pub standing: &'a [Agent],
    /// For each agent, its decided next vertex, or [`NONE`].
    pub next: &'a [Vertex],
}

impl<C: Costs> Swap<'_, C> {
    /// Returns the agent that `agent` must pull along so that the two agents can swap, or [`NONE`].
    pub fn partner(&self, agent: Agent, best: Vertex) -> Agent {
        let here = self.input.place(agent);
        if best == here {
            return NONE;
        }
        let ahead = self.standing[best as usize];
        if ahead != NONE
            && self.next[ahead as usize] == NONE
            && self.must_swap(agent, ahead, here, best)
            && self.can_swap(best, here)
        {
            return ahead;
        }
        self.pusher_behind(agent, best)
    }

    /// Returns a neighbouring agent that can pass only after this agent makes room, or [`NONE`].
    fn pusher_behind(&self, agent: Agent, best: Vertex) -> Agent {
        let here = self.input.place(agent);
        let is_pusher = |&place: &Vertex| {
            let other = self.standing[place as usize];
            other != NONE
                && place != best
                && self.must_swap(other, agent, here, best)
                && self.can_swap(best, here)
        };
        let found = self.input.graph.neighbours(here).iter().copied().find(is_pusher);
        found.map_or(NONE, |place| self.standing[place as usize])
    }

    /// Returns whether two agents must swap, with the pusher at `behind` and the puller at `ahead`.
    ///
    /// The pusher pushes the puller along the corridor while that brings the pusher closer to its goal. They must swap
    /// if three conditions hold: they meet no fork, the puller then has to go back, and the pusher has to go on or is
    /// on its goal.
    fn must_swap(&self, pusher: Agent, puller: Agent, mut behind: Vertex, mut ahead: Vertex) -> bool {
        while self.input.cost(pusher, ahead) < self.input.cost(pusher, behind) {
            match self.continuation(behind, ahead) {
                Corridor::Fork => return false,
                Corridor::End => break,
                Corridor::Only(next) => (behind, ahead) = (ahead, next),
            }
        }
        self.input.cost(puller, behind) < self.input.cost(puller, ahead)
            && (self.input.cost(pusher, behind) == 0
                || self.input.cost(pusher, ahead) < self.input.cost(pusher, behind))
    }

    /// Returns whether the puller reaches a fork by moving away from the pusher.
    fn can_swap(&self, pusher: Vertex, puller: Vertex) -> bool {
        let (mut behind, mut ahead) = (pusher, puller);
        loop {
            match self.continuation(behind, ahead) {
                Corridor::Fork => return true,
                Corridor::End => return false,
                Corridor::Only(next) => (behind, ahead) = (ahead, next),
            }
            if ahead == pusher {
                return false;
            }
        }
    }

    /// Returns how a corridor continues. A dead end occupied by an agent on its goal does not count.
    fn continuation(&self, behind: Vertex, ahead: Vertex) -> Corridor {
        let mut corridor = Corridor::End;
        for &vertex in self.input.graph.neighbours(ahead) {
            let agent = self.standing[vertex as usize];
            let is_closed = self.input.graph.neighbours(vertex).len() == 1
                && agent != NONE
                && self.input.goals[agent as usize] == vertex;
            if vertex == behind || is_closed {
                continue;
            }
            match corridor {
                Corridor::End => corridor = Corridor::Only(vertex),
                _ => return Corridor::Fork,
            }
        }
        corridor
    }
}

/// How a corridor continues.
enum Corridor {
    End,
    Only(Vertex),
    Fork,
}
