//! The search of one agent.

use pogema_core::Action;

use crate::mats_lp::cache::{Cache, Prediction};
use crate::mats_lp::evaluator::{Evaluator, Pending};
use crate::mats_lp::params::MatsLpParams;
use crate::mats_lp::simulation::Simulation;
use crate::mats_lp::tree::{Choices, NodeId, ROOT, RootChild, Tree};

/// The search of one agent.
///
/// It advances until it needs the network, so that one batch serves many searches. The published program runs the
/// network at each new leaf. With `faithful`, the value of a leaf is 0, and its priors matter only at the second visit.
/// The network therefore runs at the second visit. The tree is the same, and the network runs less often because most
/// leaves are visited once.
pub(super) struct Search<'a> {
    params: MatsLpParams,
    simulation: Simulation<'a>,
    tree: Tree,
    /// The node that the current expansion has reached, and those above it from the root on.
    node: NodeId,
    path: Vec<NodeId>,
    num_expansions: u32,
    is_waiting: bool,
    answers: Vec<Pending>,
    predictions: Vec<Prediction>,
    choices: Vec<Choices>,
    actions: Vec<Action>,
}

impl<'a> Search<'a> {
    /// Creates the search of the first agent of a group.
    pub fn new(params: MatsLpParams, simulation: Simulation<'a>) -> Self {
        let actions = vec![Action::Stay; simulation.agents().len()];
        let mut tree = Tree::new(params);
        let node = tree.add(None, 0.0);
        Self {
            params,
            simulation,
            tree,
            node,
            path: Vec::new(),
            num_expansions: 0,
            is_waiting: false,
            answers: Vec::new(),
            predictions: Vec::new(),
            choices: Vec::new(),
            actions,
        }
    }

    /// Advances until the evaluator has to be run, or to the end. Returns whether it is at the end.
    ///
    /// # Errors
    /// The position in the group of the first agent for which the network's outputs are not finite.
    pub fn advance(
        &mut self,
        evaluator: &mut Evaluator,
        cache: &Cache,
        radius: usize,
    ) -> Result<bool, usize> {
        while self.num_expansions < self.params.expansions {
            if self.is_waiting {
                self.is_waiting = false;
                self.expand(evaluator)?;
            } else if self.tree.is_expanded(self.node) {
                self.descend();
            } else {
                self.request(evaluator, cache, radius);
                self.is_waiting = true;
                if self.answers.iter().any(|answer| matches!(answer, Pending::Row(_))) {
                    return Ok(false);
                }
            }
        }
        Ok(true)
    }

    /// Moves to the best child.
    fn descend(&mut self) {
        let index = self.tree.best_child(self.node);
        self.tree.write_actions(self.node, index, &mut self.actions);
        let reward = self.simulation.step(&self.actions);
        self.path.push(self.node);
        if let Some(visited) = self.tree.child(self.node, index) {
            self.node = visited;
            return;
        }
        self.node = self.tree.add(Some((self.node, index)), reward);
        if self.params.faithful {
            self.back_up(0.0);
        }
    }

    /// Adds the value of a new leaf to all nodes above, and returns to the root.
    fn back_up(&mut self, value: f32) {
        self.tree.back_up(&self.path, self.node, value);
        self.simulation.restart();
        self.path.clear();
        self.node = ROOT;
        self.num_expansions += 1;
    }

    fn request(&mut self, evaluator: &mut Evaluator, cache: &Cache, radius: usize) {
        self.answers.clear();
        for position in 0..self.simulation.agents().len() {
            let key = self.simulation.key(position, radius);
            let simulation = &self.simulation;
            let write = |key: &_, input: &mut [f32]| simulation.write_input(position, key, input);
            self.answers.push(evaluator.request(key, cache, write));
        }
    }

    /// Adds the children of the node that was evaluated.
    fn expand(&mut self, evaluator: &Evaluator) -> Result<(), usize> {
        self.predictions.clear();
        for (position, &answer) in self.answers.iter().enumerate() {
            self.predictions.push(evaluator.prediction(answer).ok_or(position)?);
        }
        self.choices.clear();
        for (position, prediction) in self.predictions.iter().enumerate() {
            let plans = position < self.params.agents_to_plan;
            let is_possible = |action: &Action| self.simulation.is_possible(position, *action);
            let choice = if plans {
                Action::ALL
                    .into_iter()
                    .filter(is_possible)
                    .fold(0, |choice, action| choice | 1 << action as u8)
            } else {
                1 << most_probable(prediction)
            };
            self.choices.push(choice);
        }
        self.tree.expand(self.node, &self.choices, &self.predictions);
        if !self.params.faithful {
            let sum: f32 = self.predictions.iter().map(|prediction| prediction.value).sum();
            let value = sum / self.predictions.len() as f32;
            self.tree.set_value(self.node, value);
            if self.node != ROOT {
                self.back_up(value);
            }
        }
        Ok(())
    }

    /// Returns the agent's own action in the most visited joint action.
    pub fn answer(&mut self) -> Action {
        let child = self.tree.most_visited();
        self.tree.write_actions(ROOT, child, &mut self.actions);
        self.actions[0]
    }

    /// Returns the statistics of each child of the root.
    pub fn root_children(&self) -> Vec<RootChild> {
        self.tree.root_children()
    }
}

/// Returns the number of the most probable action; if several are equally probable, the first of them.
fn most_probable(prediction: &Prediction) -> usize {
    let values = &prediction.probabilities;
    (1..values.len()).fold(0, |best, action| if values[action] > values[best] { action } else { best })
}
