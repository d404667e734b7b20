//! Compares every two steps from every placement with every choice of goals: states, results and observations.

use pogema_core::{Action, Cell, Config, Environment, GoalStream, Instance, Map, OnGoal, Outside, Snapshot};
use pogema_fast::Engine;
use pogema_reference::Reference;

use crate::scope::{RULES, Results, Scope, cells_of, placements, tuples, write_actions};

const ON_GOAL: [OnGoal; 3] = [OnGoal::Finish, OnGoal::Nothing, OnGoal::Restart];

/// Returns the number of steps that [`check_map`] compares over all maps: from each placement, with each choice of
/// goals and under all rules, all first steps, and after each of them all second steps.
pub fn num_steps(scope: Scope) -> u64 {
    let num_goals = (scope.num_cells() as u64).pow(scope.num_agents as u32);
    let num_actions = scope.num_actions() as u64;
    let num_rules = (RULES.len() * ON_GOAL.len()) as u64;
    scope.num_placements() * num_goals * (num_actions + num_actions * num_actions) * num_rules
}

/// Compares all steps on a map and counts them.
pub fn check_map(scope: Scope, map: &Map) -> u64 {
    let starts = placements(map, scope.num_agents);
    let goals = tuples(&cells_of(map), scope.num_agents);
    let mut count = 0;
    for (collision, occupancy) in RULES {
        for on_goal in ON_GOAL {
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

/// All outputs of a step.
#[derive(Clone, Debug, PartialEq)]
struct Outputs {
    state: Snapshot,
    results: Results,
    observation: Vec<f32>,
}

impl Outputs {
    fn step(environment: &mut impl Environment, actions: &[Action]) -> Self {
        let mut results = Results::new(actions.len());
        environment.step(actions, results.out()).unwrap();
        let mut observation = vec![7.0; environment.config().num_observed()];
        environment.observe(&mut observation).unwrap();
        Self { state: environment.snapshot(), results, observation }
    }
}

struct Both {
    reference: Reference,
    engine: Engine,
}

impl Both {
    fn new(config: Config) -> Self {
        Self { reference: Reference::new(config).unwrap(), engine: Engine::new(config).unwrap() }
    }

    fn check_instance(&mut self, instance: &Instance) -> u64 {
        let num_agents = instance.starts().len();
        let num_actions = 5usize.pow(num_agents as u32);
        let (mut first, mut second) = (vec![Action::Stay; num_agents], vec![Action::Stay; num_agents]);
        self.reference.reset(instance).unwrap();
        // Different first steps may reach the same state, whose second steps are played only once.
        let mut played: Vec<(Snapshot, Vec<Outputs>)> = Vec::new();
        for number in 0..num_actions {
            write_actions(number, &mut first);
            let mut reference = self.reference.clone();
            let expected = Outputs::step(&mut reference, &first);
            self.engine.reset(instance).unwrap();
            let actual = Outputs::step(&mut self.engine, &first);
            assert_eq!(expected, actual, "{first:?} {instance:?} {:?}", self.engine.config());
            let known = played.iter().position(|(state, _)| *state == expected.state);
            let known = known.unwrap_or_else(|| {
                played.push((expected.state, all_steps(&reference, num_actions)));
                played.len() - 1
            });
            for (number, expected) in played[known].1.iter().enumerate() {
                write_actions(number, &mut second);
                self.engine.reset(instance).unwrap();
                self.engine.step(&first, Results::new(num_agents).out()).unwrap();
                let actual = Outputs::step(&mut self.engine, &second);
                assert_eq!(expected, &actual, "{first:?} {second:?} {instance:?} {:?}", self.engine.config());
            }
        }
        (num_actions + num_actions * num_actions) as u64
    }
}

fn all_steps(reference: &Reference, num_actions: usize) -> Vec<Outputs> {
    let mut actions = vec![Action::Stay; reference.config().num_agents];
    let step = |number: usize| {
        write_actions(number, &mut actions);
        Outputs::step(&mut reference.clone(), &actions)
    };
    (0..num_actions).map(step).collect()
}
