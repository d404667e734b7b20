//! Compares the engines after each two steps from every placement, for every choice of goals: states, results and
//! observations.

use std::fmt::Debug;

use pogema_core::{
    Action, Cell, Config, Environment, GoalStream, Instance, Map, OnGoal, Outside, Snapshot, StepResults,
    Words,
};
use pogema_fast::Engine;
use pogema_reference::Reference;

use crate::scope::{RULES, Scope, cells_of, is_in, placements, tuples, write_actions};

/// Returns the number of steps that [`check_map`] compares over all maps: from each placement, with each choice of
/// goals and under all rules, all first steps, and after each of them all second steps.
pub fn num_steps(scope: Scope) -> u64 {
    let num_goals = (scope.num_cells() as u64).pow(scope.num_agents as u32);
    let num_actions = scope.num_actions() as u64;
    let num_rules = (RULES.len() * OnGoal::WORDS.len()) as u64;
    scope.num_placements() * num_goals * (num_actions + num_actions * num_actions) * num_rules
}

/// Compares all steps on a map and counts them.
pub fn check_map(scope: Scope, map: &Map) -> u64 {
    let starts = placements(map, scope.num_agents);
    let goals = tuples(&cells_of(map), scope.num_agents);
    let mut count = 0;
    for (collision, occupancy) in RULES {
        for on_goal in OnGoal::all() {
            let (num_agents, max_steps) = (scope.num_agents, 2);
            let config = Config {
                num_agents,
                radius: 1,
                max_steps,
                collision,
                on_goal,
                occupancy,
                ..Config::default()
            };
            let mut both = Both::new(config);
            for starts in &starts {
                for goals in &goals {
                    count += both.check_instance(&instance(map, starts, goals));
                }
            }
        }
    }
    count
}

/// Returns an instance in which each first goal is followed by a second one on the next cell of the map.
fn instance(map: &Map, starts: &[Cell], goals: &[Cell]) -> Instance {
    let next = |goal: Cell| map.cell_at((map.index(goal) + 1) % map.obstacles().len());
    let stream = |&goal: &Cell| GoalStream::sequence(goal, [goal, next(goal)].into());
    let goals = goals.iter().map(stream).collect();
    Instance::new(map.clone(), Outside::Free, starts.to_vec(), goals).unwrap()
}

/// All outputs of a step besides the state.
#[derive(Clone, Debug, PartialEq)]
struct Outputs {
    results: StepResults,
    observation: Vec<f32>,
}

impl Outputs {
    fn new(config: &Config) -> Self {
        Self { results: StepResults::new(config.num_agents), observation: vec![0.0; config.num_observed()] }
    }

    fn step(&mut self, environment: &mut impl Environment, actions: &[Action]) {
        // Values that the engine does not write must not look like those of the last step.
        self.observation.fill(7.0);
        self.results.rewards.fill(-1.0);
        self.results.terminated.fill(true);
        self.results.truncated.fill(true);
        environment.step(actions, self.results.out()).unwrap();
        environment.observe(&mut self.observation).unwrap();
    }
}

/// A state that the reference reaches, and the outputs of the step to it.
type Reached = (Snapshot, Outputs);

fn step(mut reference: Reference, actions: &[Action]) -> (Reference, Reached) {
    let mut outputs = Outputs::new(reference.config());
    outputs.step(&mut reference, actions);
    let state = reference.snapshot();
    (reference, (state, outputs))
}

struct Both {
    reference: Reference,
    engine: Engine,
    /// The outputs of the engine's last step.
    actual: Outputs,
}

impl Both {
    fn new(config: Config) -> Self {
        let (reference, engine) = (Reference::new(config).unwrap(), Engine::new(config).unwrap());
        Self { reference, engine, actual: Outputs::new(&config) }
    }

    fn assert_reaches(&mut self, (state, outputs): &Reached, actions: &[Action], before: impl Debug) {
        self.actual.step(&mut self.engine, actions);
        assert!(
            is_in(&self.engine, state) && self.actual == *outputs,
            "{state:?} {outputs:?}, {:?} {:?}: {before:?} {actions:?} {:?}",
            self.engine.snapshot(),
            self.actual,
            self.engine.config()
        );
    }

    fn check_instance(&mut self, instance: &Instance) -> u64 {
        let num_agents = instance.starts().len();
        let num_actions = 5usize.pow(num_agents as u32);
        let (mut first, mut second) = (vec![Action::Stay; num_agents], vec![Action::Stay; num_agents]);
        self.reference.reset(instance).unwrap();
        // Different first steps may reach the same state, from which the reference plays the second steps only once.
        let mut played: Vec<(Snapshot, Vec<Reached>)> = Vec::new();
        let mut results = StepResults::new(num_agents);
        for number in 0..num_actions {
            write_actions(number, &mut first);
            let (reference, expected) = step(self.reference.clone(), &first);
            self.engine.reset(instance).unwrap();
            self.assert_reaches(&expected, &first, instance);
            let known = played.iter().position(|(state, _)| *state == expected.0);
            let known = known.unwrap_or_else(|| {
                played.push((expected.0, all_steps(&reference, num_actions)));
                played.len() - 1
            });
            for (number, expected) in played[known].1.iter().enumerate() {
                write_actions(number, &mut second);
                self.engine.reset(instance).unwrap();
                self.engine.step(&first, results.out()).unwrap();
                self.assert_reaches(expected, &second, (&first, instance));
            }
        }
        (num_actions + num_actions * num_actions) as u64
    }
}

fn all_steps(reference: &Reference, num_actions: usize) -> Vec<Reached> {
    let mut actions = vec![Action::Stay; reference.config().num_agents];
    let reached = |number: usize| {
        write_actions(number, &mut actions);
        step(reference.clone(), &actions).1
    };
    (0..num_actions).map(reached).collect()
}
