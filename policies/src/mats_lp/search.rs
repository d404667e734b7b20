//! The search of one agent.

use pogema_core::Action;

use crate::mats_lp::cache::{Cache, Outlook};
use crate::mats_lp::evaluator::{Answer, Evaluator};
use crate::mats_lp::params::MatsLpParams;
use crate::mats_lp::simulation::Simulation;
use crate::mats_lp::tree::{Choices, NodeId, Tree};

/// The search of one agent, which advances by one expansion at a time.
///
/// Between [`Search::select`] and [`Search::expand`], the batch of the evaluator is run.
pub(super) struct Search<'a> {
    params: MatsLpParams,
    simulation: Simulation<'a>,
    tree: Tree,
    /// The nodes from the root to the leaf's parent, and the child that is the leaf.
    path: Vec<NodeId>,
    leaf: u32,
    reward: f32,
    answers: Vec<Answer>,
    outlooks: Vec<Outlook>,
    choices: Vec<Choices>,
    actions: Vec<Action>,
}

impl<'a> Search<'a> {
    /// Creates the search of a group. Its own agent comes first.
    pub fn new(params: MatsLpParams, simulation: Simulation<'a>) -> Self {
        let actions = vec![Action::Stay; simulation.agents().len()];
        Self {
            params,
            simulation,
            tree: Tree::new(params),
            path: Vec::new(),
            leaf: 0,
            reward: 0.0,
            answers: Vec::new(),
            outlooks: Vec::new(),
            choices: Vec::new(),
            actions,
        }
    }

    /// Requests the evaluation of the root.
    pub fn begin(&mut self, evaluator: &mut Evaluator, cache: &Cache, radius: usize) {
        self.path.clear();
        self.request(evaluator, cache, radius);
    }

    /// Follows the best children from the root to a new leaf, and requests its evaluation.
    pub fn select(&mut self, evaluator: &mut Evaluator, cache: &Cache, radius: usize) {
        self.simulation.restart();
        self.path.clear();
        let mut node = 0;
        loop {
            let child = self.tree.best_child(node);
            self.tree.write_actions(node, child, &mut self.actions);
            self.reward = self.simulation.step(&self.actions);
            self.path.push(node);
            match self.tree.child(node, child) {
                Some(visited) => node = visited,
                None => {
                    self.leaf = child;
                    break;
                }
            }
        }
        self.request(evaluator, cache, radius);
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

    /// Adds the evaluated leaf to the tree and its value to all nodes above.
    ///
    /// # Errors
    /// The position in the group of the first agent for which the network's outputs are not finite.
    pub fn expand(&mut self, evaluator: &Evaluator) -> Result<(), usize> {
        self.outlooks.clear();
        for (position, &answer) in self.answers.iter().enumerate() {
            self.outlooks.push(evaluator.outlook(answer).ok_or(position)?);
        }
        self.choices.clear();
        for (position, outlook) in self.outlooks.iter().enumerate() {
            let plans = position < self.params.agents_to_plan;
            let is_possible = |action: &Action| self.simulation.is_possible(position, *action);
            let choice = if plans {
                Action::ALL
                    .into_iter()
                    .filter(is_possible)
                    .fold(0, |choice, action| choice | 1 << action as u8)
            } else {
                1 << likeliest(outlook)
            };
            self.choices.push(choice);
        }
        let value = self.leaf_value();
        let Some(&parent) = self.path.last() else {
            self.tree.add(&self.choices, &self.outlooks, 0.0, value);
            return Ok(());
        };
        let leaf = self.tree.add(&self.choices, &self.outlooks, self.reward, value);
        self.tree.set_child(parent, self.leaf, leaf);
        self.tree.back_up(&self.path, leaf, value);
        Ok(())
    }

    /// Returns the mean of the critic's values, which the published program does not read.
    fn leaf_value(&self) -> f32 {
        if self.params.faithful {
            return 0.0;
        }
        let sum: f32 = self.outlooks.iter().map(|outlook| outlook.value).sum();
        sum / self.outlooks.len() as f32
    }

    /// Returns the agent's own action in the most visited joint action.
    pub fn answer(&mut self) -> Action {
        let child = self.tree.most_visited();
        self.tree.write_actions(0, child, &mut self.actions);
        self.actions[0]
    }
}

/// Returns the number of the likeliest action; the first of equals.
fn likeliest(outlook: &Outlook) -> usize {
    let values = &outlook.probabilities;
    (1..values.len()).fold(0, |best, action| if values[action] > values[best] { action } else { best })
}
