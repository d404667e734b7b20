//! The search of MATS-LP in plain code: recursive, one state at a time, with the reference engine.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::{BTreeMap, VecDeque};

use pogema_core::{Action, Cell, Collision, Config, Environment, GoalStream, Instance, Map, OnGoal, Outside};
use pogema_core::{State, StepResults};
use pogema_policies::{MatsLpParams, RootChild};
use pogema_reference::Reference;

use super::network::Linear;

type Place = (i32, i32);

/// An agent of a group.
#[derive(Clone, Debug)]
struct Agent {
    cell: Cell,
    /// The current goal and later ones.
    goals: VecDeque<Cell>,
    best: i32,
    is_done: bool,
}

/// The policy, and what it remembers of the episode.
pub struct Slow<'a> {
    pub network: Linear,
    pub params: MatsLpParams,
    pub radius: usize,
    pub map: &'a Map,
    pub on_goal: OnGoal,
    /// The goal of each agent, and its smallest cost so far.
    pub best: Vec<(Cell, i32)>,
    /// The children of each agent's root in the last step.
    pub roots: Vec<Vec<RootChild>>,
}

#[derive(Debug)]
struct Node {
    prior: f64,
    num_visits: u32,
    value_sum: f64,
    reward: f32,
    joint_actions: Vec<Vec<Action>>,
    children: Vec<Node>,
}

impl Node {
    fn new(prior: f64) -> Self {
        Self { prior, num_visits: 0, value_sum: 0.0, reward: 0.0, joint_actions: vec![], children: vec![] }
    }
}

impl Slow<'_> {
    /// Returns the actions of all agents; `goals` lists the current and later goals of each.
    pub fn act(&mut self, now: State<'_>, goals: &[Vec<Cell>]) -> Vec<Action> {
        for agent in 0..now.cells.len() {
            let (goal, cost) = (now.goals[agent], self.cost(now.goals[agent], now.cells[agent]));
            match self.best.get_mut(agent) {
                Some(known) if known.0 == goal => known.1 = known.1.min(cost),
                Some(known) => *known = (goal, cost),
                None => self.best.push((goal, cost)),
            }
        }
        let search = |agent| {
            if now.active[agent] { self.search(agent, now, goals) } else { (Action::Stay, Vec::new()) }
        };
        let (actions, roots) = (0..now.cells.len()).map(search).unzip();
        self.roots = roots;
        actions
    }

    /// Returns the action of an agent and the children of its root.
    fn search(&self, own: usize, now: State<'_>, goals: &[Vec<Cell>]) -> (Action, Vec<RootChild>) {
        let agent = |index: usize| Agent {
            cell: now.cells[index],
            goals: goals[index].iter().copied().collect(),
            best: self.best[index].1,
            is_done: false,
        };
        let group: Vec<Agent> = self.group(own, now).into_iter().map(agent).collect();
        let mut root = Node::new(1.0);
        let mut bounds = (f64::INFINITY, f64::NEG_INFINITY);
        self.evaluate(&mut root, &group);
        let equal = (1.0 / root.children.len() as f64) as f32;
        let share = self.params.root_noise as f32;
        for child in &mut root.children {
            child.prior = child.prior * f64::from(1.0 - share) + f64::from(equal * share);
        }
        for _ in 0..self.params.expansions {
            self.visit(&mut root, group.clone(), &mut bounds);
        }
        let most = root.children.iter().map(|child| child.num_visits).max().unwrap();
        let best = root.children.iter().position(|child| child.num_visits == most).unwrap();
        let known = |child: &Node| RootChild { num_visits: child.num_visits, value_sum: child.value_sum };
        (root.joint_actions[best][0], root.children.iter().map(known).collect())
    }

    /// Visits a node; returns the value to back up, and the reward of the leaf.
    fn visit(&self, node: &mut Node, group: Vec<Agent>, bounds: &mut (f64, f64)) -> (f32, f32) {
        if node.children.is_empty() {
            return (self.evaluate(node, &group), node.reward);
        }
        let scores: Vec<f32> = node.children.iter().map(|child| self.score(node, child, *bounds)).collect();
        let highest = scores.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let best = scores.iter().position(|&score| score == highest).unwrap();
        let (group, reward) = self.step(group, &node.joint_actions[best]);
        let child = &mut node.children[best];
        child.reward = reward;
        let (value, leaf_reward) = self.visit(child, group, bounds);
        let discount = self.params.discount;
        let step_reward = if self.params.faithful { leaf_reward } else { reward };
        let gain = f64::from(step_reward) + discount * f64::from(value);
        let seen = if self.params.faithful { f64::from(value) } else { gain };
        *bounds = (bounds.0.min(seen), bounds.1.max(seen));
        node.value_sum += gain;
        node.num_visits += 1;
        let up =
            if self.params.faithful { f64::from(node.reward) + discount * f64::from(value) } else { gain };
        (up as f32, leaf_reward)
    }

    fn score(&self, parent: &Node, child: &Node, (min, max): (f64, f64)) -> f32 {
        let exploration = f64::from(self.params.exploration as f32);
        let weight = exploration * (f64::from(parent.num_visits).sqrt() / f64::from(child.num_visits + 1));
        let mut value = 0.0;
        if child.num_visits > 0 {
            let mean = child.value_sum / f64::from(child.num_visits);
            value = (f64::from(child.reward) + self.params.discount * mean).max(min);
            if max > min {
                value = (value - min) / (max - min);
            }
        }
        (f64::from(weight as f32) * child.prior + f64::from(value as f32)) as f32
    }

    /// Runs the network for each agent, creates the children, and returns the value of the node.
    fn evaluate(&self, node: &mut Node, group: &[Agent]) -> f32 {
        let outputs: Vec<_> =
            (0..group.len()).map(|position| self.network.forward(&self.input(position, group))).collect();
        let probabilities: Vec<Vec<f32>> = outputs.iter().map(|output| softmax(&output.logits)).collect();
        let choices: Vec<Vec<Action>> = (0..group.len())
            .map(|position| {
                if position < self.params.agents_to_plan {
                    let is_open = |action: &Action| self.is_open(group[position].cell.toward(*action));
                    return Action::ALL.into_iter().filter(is_open).collect();
                }
                let values = &probabilities[position];
                let largest = values.iter().copied().fold(f32::NEG_INFINITY, f32::max);
                vec![Action::ALL[values.iter().position(|&value| value == largest).unwrap()]]
            })
            .collect();
        let count = choices.iter().map(Vec::len).product();
        for index in 0..count {
            let (mut rest, mut prior, mut actions) = (index, 1.0_f32, Vec::new());
            for (position, choice) in choices.iter().enumerate() {
                let action = choice[rest % choice.len()];
                rest /= choice.len();
                if choice.len() > 1 {
                    prior *= probabilities[position][action as usize];
                }
                actions.push(action);
            }
            node.joint_actions.push(actions);
            node.children.push(Node::new(f64::from(prior)));
        }
        let sum: f32 = node.children.iter().map(|child| child.prior as f32).sum();
        for child in &mut node.children {
            child.prior /= f64::from(sum);
        }
        let mean = outputs.iter().map(|output| output.value).sum::<f32>() / group.len() as f32;
        let value = if self.params.faithful { 0.0 } else { mean };
        (node.num_visits, node.value_sum) = (1, f64::from(value));
        value
    }

    /// Plays one step of the group alone, on the reference engine.
    fn step(&self, mut group: Vec<Agent>, actions: &[Action]) -> (Vec<Agent>, f32) {
        let config = Config {
            num_agents: group.len(),
            collision: Collision::Soft,
            on_goal: OnGoal::Nothing,
            ..Config::default()
        };
        let starts: Vec<Cell> = group.iter().map(|agent| agent.cell).collect();
        let goals = starts.iter().map(|&cell| GoalStream::single(cell)).collect();
        let mut engine = Reference::new(config).unwrap();
        engine.reset(&Instance::new(self.map.clone(), Outside::Free, starts, goals).unwrap()).unwrap();
        let stays = |(agent, &action): (&Agent, &Action)| if agent.is_done { Action::Stay } else { action };
        let actions: Vec<Action> = group.iter().zip(actions).map(stays).collect();
        engine.step(&actions, StepResults::new(group.len()).out()).unwrap();
        let (mut reward, share) = (0.0_f32, self.params.progress_reward / group.len() as f64);
        for (agent, &cell) in group.iter_mut().zip(engine.state().cells) {
            agent.cell = cell;
            let cost = self.cost(agent.goals[0], cell);
            if cost < agent.best {
                reward = (f64::from(reward) + share) as f32;
                agent.best = cost;
            }
            if cell != agent.goals[0] {
                continue;
            }
            if agent.goals.len() > 1 {
                agent.goals.pop_front();
                agent.best = self.cost(agent.goals[0], cell);
            } else if self.on_goal == OnGoal::Finish {
                agent.is_done = true;
            }
        }
        (group, reward)
    }

    /// Returns the network's input for an agent.
    fn input(&self, position: usize, group: &[Agent]) -> Vec<f32> {
        let (own, radius) = (&group[position], self.radius as i32);
        let (row, col) = place(own.cell);
        let window: Vec<Place> = (row - radius..=row + radius)
            .flat_map(|row| (col - radius..=col + radius).map(move |col| (row, col)))
            .collect();
        let has_agent = |&at: &Place| f32::from(u8::from(group.iter().any(|agent| place(agent.cell) == at)));
        let mut input: Vec<f32> = window.iter().map(has_agent).collect();
        let costs = self.costs(own.goals[0]);
        let mut centre = -1.0;
        if let Some(&now) = costs.get(&(row, col)) {
            let seen: Vec<Option<i32>> = window.iter().map(|at| costs.get(at).copied()).collect();
            let missing = seen.iter().flatten().max().unwrap() + 4;
            let filled: Vec<i32> = seen.iter().map(|cost| cost.unwrap_or(missing)).collect();
            let (low, high) = (filled.iter().min().unwrap(), filled.iter().max().unwrap());
            let span = ((high - low) as f32).max(1.0);
            input.extend(filled.iter().map(|cost| (high - cost) as f32 / span));
            centre = -((now - own.best + 1) as f32 / 64.0).min(1.0);
        } else {
            input.extend(window.iter().map(|_| 0.0));
        }
        let half = window.len();
        input[half + half / 2] = centre;
        input
    }

    /// Returns the group of an agent: the agent itself, then the agents that are planned together with it.
    fn group(&self, own: usize, now: State<'_>) -> Vec<usize> {
        let start = place(now.cells[own]);
        let (mut steps, mut queue, mut group) =
            (BTreeMap::from([(start, 0)]), VecDeque::from([start]), vec![own]);
        while let Some(at) = queue.pop_front() {
            for (down, right) in [(-1, 0), (1, 0), (0, -1), (0, 1)] {
                let next = (at.0 + down, at.1 + right);
                if !self.is_open(next) || steps.contains_key(&next) {
                    continue;
                }
                steps.insert(next, steps[&at] + 1);
                queue.push_back(next);
                let met =
                    (0..now.cells.len()).find(|&agent| now.active[agent] && place(now.cells[agent]) == next);
                let is_near = steps[&next] < self.params.merging_range
                    && start.0.abs_diff(next.0).max(start.1.abs_diff(next.1)) <= self.params.radius;
                group.extend(met.filter(|_| is_near));
            }
        }
        group
    }

    fn is_open(&self, (row, col): Place) -> bool {
        let inside =
            (0..self.map.height() as i32).contains(&row) && (0..self.map.width() as i32).contains(&col);
        inside && !self.map.is_obstacle(Cell::new(row as u16, col as u16))
    }

    /// Returns the number of steps from a cell to a goal, or -1 if no path exists.
    fn cost(&self, goal: Cell, cell: Cell) -> i32 {
        self.costs(goal).get(&place(cell)).copied().unwrap_or(-1)
    }

    fn costs(&self, goal: Cell) -> BTreeMap<Place, i32> {
        let (mut costs, mut queue) = (BTreeMap::from([(place(goal), 0)]), VecDeque::from([place(goal)]));
        while let Some(at) = queue.pop_front() {
            for (down, right) in [(-1, 0), (1, 0), (0, -1), (0, 1)] {
                let next = (at.0 + down, at.1 + right);
                if self.is_open(next) && !costs.contains_key(&next) {
                    costs.insert(next, costs[&at] + 1);
                    queue.push_back(next);
                }
            }
        }
        costs
    }
}

fn place(cell: Cell) -> Place {
    (i32::from(cell.row), i32::from(cell.col))
}

fn softmax(logits: &[f32]) -> Vec<f32> {
    let mut probabilities = logits.to_vec();
    pogema_policies::softmax(&mut probabilities);
    probabilities
}
