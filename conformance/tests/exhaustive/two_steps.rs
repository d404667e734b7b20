//! Every two steps from every placement with every choice of goals, with all that can be seen of them.

use pogema_core::{Action, Cell, Config, Environment, GoalStream, Instance, Map, OnGoal, Outside, Snapshot};
use pogema_fast::Engine;
use pogema_reference::Reference;

use crate::scope::{RULES, Results, Scope, cells_of, placements, tuples, write_actions};

const ON_GOAL: [OnGoal; 3] = [OnGoal::Finish, OnGoal::Nothing, OnGoal::Restart];

/// Steps that [`check_map`] compares over all maps: from each placement, with each choice of goals, all first steps
/// and after each of them all second ones, by all rules.
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

/// An instance in which another goal, on the next cell of the map, follows each first one.
fn instance(map: &Map, starts: &[Cell], goals: &[Cell]) -> Instance {
    let next = |goal: Cell| map.cell_at((map.index(goal) + 1) % map.obstacles().len());
    let stream = |&goal: &Cell| GoalStream::sequence(goal, [goal, next(goal)].into());
    let goals = goals.iter().map(stream).collect();
    Instance::new(map.clone(), Outside::Free, starts.to_vec(), goals).unwrap()
}

/// All that can be seen of a step.
#[derive(Clone, Debug, PartialEq)]
struct Seen {
    state: Snapshot,
    results: Results,
    observation: Vec<f32>,
}

impl Seen {
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
        // The reference is asked once for all second steps from the same state.
        let mut asked: Vec<(Snapshot, Vec<Seen>)> = Vec::new();
        for number in 0..num_actions {
            write_actions(number, &mut first);
            let mut reference = self.reference.clone();
            let want = Seen::step(&mut reference, &first);
            self.engine.reset(instance).unwrap();
            let got = Seen::step(&mut self.engine, &first);
            assert_eq!(want, got, "{first:?} {instance:?} {:?}", self.engine.config());
            let known = asked.iter().position(|(state, _)| *state == want.state);
            let known = known.unwrap_or_else(|| {
                asked.push((want.state, all_steps(&reference, num_actions)));
                asked.len() - 1
            });
            for (number, want) in asked[known].1.iter().enumerate() {
                write_actions(number, &mut second);
                self.engine.reset(instance).unwrap();
                self.engine.step(&first, Results::new(num_agents).out()).unwrap();
                let got = Seen::step(&mut self.engine, &second);
                assert_eq!(want, &got, "{first:?} {second:?} {instance:?} {:?}", self.engine.config());
            }
        }
        (num_actions + num_actions * num_actions) as u64
    }
}

fn all_steps(reference: &Reference, num_actions: usize) -> Vec<Seen> {
    let mut actions = vec![Action::Stay; reference.config().num_agents];
    let step = |number: usize| {
        write_actions(number, &mut actions);
        Seen::step(&mut reference.clone(), &actions)
    };
    (0..num_actions).map(step).collect()
}
