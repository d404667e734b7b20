//! The tree of a search.

use pogema_core::Action;

use crate::mats_lp::cache::Prediction;
use crate::mats_lp::params::MatsLpParams;

/// The index of a visited node.
pub(super) type NodeId = u32;

/// The root.
pub(super) const ROOT: NodeId = 0;

/// The entry of a child that has not been visited. The root is not a child, so its index can serve as this mark.
const UNVISITED: NodeId = ROOT;

/// A visited node. Its children are joint actions of the group.
#[derive(Clone, Copy, Debug, Default)]
struct Node {
    num_visits: u32,
    value_sum: f64,
    /// Reward of the step that leads to this node.
    reward: f64,
    first_child: u32,
    /// 0 until the node is expanded.
    num_children: u32,
    first_choice: u32,
}

/// The actions of one agent that the children of a node combine: bit `a` is set for action `a`.
pub(super) type Choices = u8;

/// The statistics of one child of the root. Each child is a joint action of the group.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RootChild {
    /// Number of expansions that passed through the child.
    pub num_visits: u32,
    /// Sum of the values that these expansions backed up to the child.
    pub value_sum: f64,
}

/// All nodes of a search.
///
/// A child is stored as its prior alone until it is visited.
#[derive(Debug)]
pub(super) struct Tree {
    params: MatsLpParams,
    nodes: Vec<Node>,
    /// For each child of each node: its prior, and its node or [`UNVISITED`].
    priors: Vec<f64>,
    children: Vec<NodeId>,
    /// For each node and each agent of the group.
    choices: Vec<Choices>,
    bounds: Bounds,
}

/// The smallest and the largest value that a search has backed up.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    min: f64,
    max: f64,
}

impl Bounds {
    fn update(&mut self, value: f64) {
        self.min = self.min.min(value);
        self.max = self.max.max(value);
    }

    /// Maps the smallest value to 0 and the largest to 1. Smaller values count as the smallest, and larger ones exceed
    /// 1. If the bounds are equal, values are not scaled.
    fn normalise(&self, value: f64) -> f64 {
        let value = value.max(self.min);
        if self.max > self.min { (value - self.min) / (self.max - self.min) } else { value }
    }
}

impl Tree {
    /// The memory of a child that has not been visited.
    pub const CHILD_BYTES: usize = size_of::<f64>() + size_of::<NodeId>();

    /// Creates an empty tree.
    pub fn new(params: MatsLpParams) -> Self {
        Self {
            params,
            nodes: Vec::new(),
            priors: Vec::new(),
            children: Vec::new(),
            choices: Vec::new(),
            bounds: Bounds { min: f64::INFINITY, max: f64::NEG_INFINITY },
        }
    }

    /// Adds a node with one visit and the value 0, as a child of another. The root has no parent.
    pub fn add(&mut self, parent: Option<(NodeId, u32)>, reward: f32) -> NodeId {
        let id = self.nodes.len() as NodeId;
        if let Some((parent, index)) = parent {
            self.children[(self.nodes[parent as usize].first_child + index) as usize] = id;
        }
        let reward = f64::from(reward);
        self.nodes.push(Node { num_visits: 1, value_sum: 0.0, reward, ..Node::default() });
        id
    }

    /// Returns whether a node has children.
    pub fn is_expanded(&self, node: NodeId) -> bool {
        self.nodes[node as usize].num_children > 0
    }

    /// Sets the value of a node that has been visited once.
    pub fn set_value(&mut self, node: NodeId, value: f32) {
        self.nodes[node as usize].value_sum = f64::from(value);
    }

    /// Adds the children of a node, which combine the choices of the agents.
    ///
    /// The first agent's action varies fastest from child to child. An agent with a single choice contributes no
    /// factor to the priors. The priors of the root's children are mixed with a uniform distribution.
    pub fn expand(&mut self, id: NodeId, choices: &[Choices], predictions: &[Prediction]) {
        let first_child = self.priors.len();
        self.priors.push(1.0);
        for (&choice, prediction) in choices.iter().zip(predictions) {
            if choice.count_ones() > 1 {
                self.multiply(first_child, choice, prediction);
            }
        }
        let priors = &mut self.priors[first_child..];
        normalise_priors(priors);
        if id == ROOT {
            mix_with_uniform(priors, self.params.root_noise as f32);
        }
        self.children.resize(self.priors.len(), UNVISITED);
        let node = &mut self.nodes[id as usize];
        node.first_child = first_child as u32;
        node.num_children = (self.priors.len() - first_child) as u32;
        node.first_choice = self.choices.len() as u32;
        self.choices.extend_from_slice(choices);
    }

    /// Combines the joint actions from `first` on with the choices of one more agent.
    fn multiply(&mut self, first: usize, choice: Choices, prediction: &Prediction) {
        let len = self.priors.len() - first;
        let mut actions = chosen(choice).map(|action| f64::from(prediction.probabilities[action as usize]));
        let factor = actions.next().unwrap_or(1.0);
        for factor in actions {
            for index in first..first + len {
                self.priors.push(product(self.priors[index], factor));
            }
        }
        for prior in &mut self.priors[first..first + len] {
            *prior = product(*prior, factor);
        }
    }

    /// Returns the child with the highest score, as an index among the children of a node. If several are
    /// equal, returns the first of them.
    pub fn best_child(&self, node: NodeId) -> u32 {
        let parent = self.nodes[node as usize];
        let range = parent.first_child as usize..(parent.first_child + parent.num_children) as usize;
        let root = f64::from(parent.num_visits).sqrt();
        let (mut best, mut best_score) = (0, f32::NEG_INFINITY);
        for (index, (&prior, &child)) in
            self.priors[range.clone()].iter().zip(&self.children[range]).enumerate()
        {
            let score = self.score(root, prior, child);
            if score > best_score {
                (best, best_score) = (index, score);
            }
        }
        best as u32
    }

    /// Returns the score of a child, rounded where the published program rounds.
    fn score(&self, root: f64, prior: f64, child: NodeId) -> f32 {
        let exploration = f64::from(self.params.exploration as f32);
        if child == UNVISITED {
            return (f64::from((exploration * root) as f32) * prior) as f32;
        }
        let node = self.nodes[child as usize];
        let visits = f64::from(node.num_visits);
        let weight = f64::from((exploration * (root / (visits + 1.0))) as f32);
        let value = self.bounds.normalise(node.reward + self.params.discount * (node.value_sum / visits));
        (weight * prior + f64::from(value as f32)) as f32
    }

    /// Returns the node of a child, if it has been visited.
    pub fn child(&self, node: NodeId, index: u32) -> Option<NodeId> {
        let child = self.children[(self.nodes[node as usize].first_child + index) as usize];
        (child != UNVISITED).then_some(child)
    }

    /// Writes the joint action of a child, one action per agent.
    pub fn write_actions(&self, node: NodeId, index: u32, actions: &mut [Action]) {
        let first = self.nodes[node as usize].first_choice as usize;
        let mut rest = index;
        for (action, &choice) in actions.iter_mut().zip(&self.choices[first..]) {
            let count = choice.count_ones();
            *action = chosen(choice).nth((rest % count) as usize).unwrap_or_default();
            rest /= count;
        }
    }

    /// Adds the value of a new leaf to all nodes above it. `path` leads from the root to the leaf's parent.
    pub fn back_up(&mut self, path: &[NodeId], leaf: NodeId, value: f32) {
        let MatsLpParams { discount, faithful, .. } = self.params;
        let leaf_reward = self.nodes[leaf as usize].reward;
        let (mut value, mut child) = (value, leaf);
        for &id in path.iter().rev() {
            let step_reward = if faithful { leaf_reward } else { self.nodes[child as usize].reward };
            let gain = step_reward + discount * f64::from(value);
            self.bounds.update(if faithful { f64::from(value) } else { gain });
            let node = &mut self.nodes[id as usize];
            node.value_sum += gain;
            node.num_visits += 1;
            value = if faithful { node.reward + discount * f64::from(value) } else { gain } as f32;
            child = id;
        }
    }

    /// Returns the most visited child of the root; if several are equal, the first of them.
    pub fn most_visited(&self) -> u32 {
        let visits = |index| self.child(ROOT, index).map_or(0, |child| self.nodes[child as usize].num_visits);
        let num_children = self.nodes[ROOT as usize].num_children;
        (0..num_children).fold(0, |best, index| if visits(index) > visits(best) { index } else { best })
    }

    /// Returns the children of the root in the order of their joint actions.
    pub fn root_children(&self) -> Vec<RootChild> {
        let child = |index| {
            self.child(ROOT, index).map_or_else(RootChild::default, |child| {
                let Node { num_visits, value_sum, .. } = self.nodes[child as usize];
                RootChild { num_visits, value_sum }
            })
        };
        (0..self.nodes[ROOT as usize].num_children).map(child).collect()
    }
}

/// Returns the actions of a choice in the order of their numbers.
fn chosen(choice: Choices) -> impl Iterator<Item = Action> {
    Action::ALL.into_iter().filter(move |&action| choice >> action as u8 & 1 == 1)
}

/// Multiplies in single precision, as the published program does.
fn product(one: f64, other: f64) -> f64 {
    f64::from(one as f32 * other as f32)
}

/// Divides priors by their sum. If all are 0, they become equal.
fn normalise_priors(priors: &mut [f64]) {
    let sum = f64::from(priors.iter().fold(0.0_f32, |sum, &prior| sum + prior as f32));
    let equal = 1.0 / priors.len() as f64;
    for prior in priors {
        *prior = if sum > 0.0 { *prior / sum } else { equal };
    }
}

fn mix_with_uniform(priors: &mut [f64], share: f32) {
    let uniform = (1.0 / priors.len() as f64) as f32 * share;
    for prior in priors {
        *prior = *prior * f64::from(1.0 - share) + f64::from(uniform);
    }
}
