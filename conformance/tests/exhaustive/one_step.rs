//! Compares every step from every placement, with any subset of the agents finished.

use pogema_core::{
    Action, Cell, Config, Environment, GoalStream, Instance, Map, OnGoal, Outside, Snapshot, StepResults,
};
use pogema_fast::Engine;
use pogema_reference::Reference;

use crate::scope::{RULES, Scope, cells_of, is_in, placements, write_actions};

/// Returns the number of steps that [`check_map`] compares over all maps: each placement with each set of active
/// agents, each joint action and all rules.
pub fn num_steps(scope: Scope) -> u64 {
    (scope.num_placements() * scope.num_actions() as u64 * RULES.len() as u64) << scope.num_agents
}

/// Compares all steps on a map, with any subset of the agents finished, and counts them.
pub fn check_map(scope: Scope, map: &Map) -> u64 {
    (0..1 << scope.num_agents).map(|gone| check_without(gone, scope, map)).sum()
}

/// Compares all steps on a map where some agents are finished; `gone` is a bit set of them.
fn check_without(gone: usize, scope: Scope, map: &Map) -> u64 {
    let starts = placements(map, scope.num_agents);
    // Agents can leave only by finishing; if none does, goals must not matter.
    let on_goal = if gone == 0 { OnGoal::Nothing } else { OnGoal::Finish };
    let mut count = 0;
    for (collision, occupancy) in RULES {
        let num_agents = scope.num_agents;
        let config = Config { num_agents, radius: 1, collision, on_goal, occupancy, ..Config::default() };
        let mut both = Both::new(config, gone);
        for starts in &starts {
            count += both.check_placement(map, starts);
        }
    }
    count
}

/// Both engines, and the agents that finish before the compared step.
struct Both {
    reference: Reference,
    engine: Engine,
    gone: usize,
    results: StepResults,
    /// The states that the reference reaches, by joint action.
    expected: Vec<Option<Snapshot>>,
}

impl Both {
    fn new(config: Config, gone: usize) -> Self {
        Self {
            reference: Reference::new(config).unwrap(),
            engine: Engine::new(config).unwrap(),
            gone,
            results: StepResults::new(config.num_agents),
            expected: vec![None; 5usize.pow(config.num_agents as u32)],
        }
    }

    fn is_gone(&self, agent: usize) -> bool {
        self.gone >> agent & 1 == 1
    }

    fn check_placement(&mut self, map: &Map, starts: &[Cell]) -> u64 {
        let goal = |agent: usize| {
            GoalStream::single(if self.is_gone(agent) { starts[agent] } else { far_from(map, starts[agent]) })
        };
        let goals = (0..starts.len()).map(goal).collect();
        let instance = Instance::new(map.clone(), Outside::Free, starts.to_vec(), goals).unwrap();
        let waits = vec![Action::Stay; starts.len()];
        self.reference.reset(&instance).unwrap();
        if self.gone != 0 {
            self.reference.step(&waits, self.results.out()).unwrap();
        }
        let active: Vec<bool> = (0..starts.len()).map(|agent| !self.is_gone(agent)).collect();
        assert_eq!(self.reference.snapshot().active, active, "{starts:?} on\n{}", map.rows().join("\n"));
        let config = *self.engine.config();
        let mut actions = waits.clone();
        for number in 0..self.expected.len() {
            self.engine.reset(&instance).unwrap();
            if self.gone != 0 {
                self.engine.step(&waits, self.results.out()).unwrap();
            }
            write_actions(number, &mut actions);
            self.engine.step(&actions, self.results.out()).unwrap();
            let played = self.expect(number, &actions);
            // INVARIANT: the state was stored before.
            let expected = self.expected[played].as_ref().unwrap();
            assert!(
                is_in(&self.engine, expected),
                "{expected:?}, {:?}: {starts:?} {actions:?} {instance:?} {config:?}",
                self.engine.snapshot()
            );
        }
        self.expected.len() as u64
    }

    /// Stores the state that the reference reaches, and returns its index. The actions of finished agents have no
    /// effect (rule: move/inactive), so joint actions that differ only in those form a class. From each class, the
    /// reference plays only the joint action in which the finished agents wait. This joint action has the lowest number
    /// of its class.
    fn expect(&mut self, number: usize, actions: &[Action]) -> usize {
        let digit = |agent: usize| 5usize.pow(agent as u32);
        let gone = (0..actions.len()).filter(|&agent| self.is_gone(agent));
        let played = number - gone.map(|agent| number / digit(agent) % 5 * digit(agent)).sum::<usize>();
        if played == number {
            let mut reference = self.reference.clone();
            reference.step(actions, self.results.out()).unwrap();
            self.expected[number] = Some(reference.snapshot());
        }
        played
    }
}

/// Returns a goal that the agent cannot reach in one step. If the map has none, returns any cell other than the start;
/// if there is no other cell, returns the start.
fn far_from(map: &Map, start: Cell) -> Cell {
    let is_far = |cell: &Cell| *cell != start && (map.is_obstacle(*cell) || cell.distance(start) > 1);
    let cells = cells_of(map);
    let far = cells.iter().copied().find(is_far);
    far.or_else(|| cells.into_iter().find(|&cell| cell != start)).unwrap_or(start)
}
