//! Episodes to draw.

use pogema_core::{
    Action, Environment, Instance, Snapshot, StepOut, Trace, TraceHeader, TraceStart, TraceStep,
};
use pogema_maps::{GridConfig, InstanceSource, value_from_yaml};
use pogema_numpy::Generator;
use pogema_planners::{PomapfObservations, pogema_team, sample};
use pogema_reference::Reference;

/// Who moves the agents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Policy {
    AStar,
    Random,
}

/// The config that a YAML text describes.
pub fn config(text: &str) -> GridConfig {
    GridConfig::from_value(&value_from_yaml(text).unwrap()).unwrap()
}

/// An episode of a config, played to its end.
pub fn trace(config: &GridConfig, policy: Policy) -> Trace {
    let generated = InstanceSource::new(config.clone(), None).unwrap().generate().unwrap();
    let mut environment = Reference::new(config.rules()).unwrap();
    environment.reset(&generated.instance).unwrap();
    let (mut team, mut dice) = (pogema_team(), Generator::seeded(1));
    let start = TraceStart { state: environment.snapshot(), observations: None };
    let mut steps: Vec<TraceStep> = Vec::new();
    let is_over = |steps: &[TraceStep]| {
        steps.last().is_some_and(|last| {
            last.terminated.iter().all(|&ended| ended) || last.truncated.iter().all(|&ended| ended)
        })
    };
    while !is_over(&steps) {
        let actions = match policy {
            Policy::AStar => team.act(PomapfObservations::of(&environment).unwrap().each()).unwrap(),
            Policy::Random => sample(&mut dice, config.num_agents),
        };
        steps.push(step(&mut environment, actions));
    }
    Trace { header: header(config, &generated.instance, steps.len()), start, steps }
}

fn header(config: &GridConfig, instance: &Instance, num_steps: usize) -> TraceHeader {
    TraceHeader::new(config.rules(), instance, num_steps + 1)
}

fn step(environment: &mut Reference, actions: Vec<Action>) -> TraceStep {
    let num_agents = actions.len();
    let (mut rewards, mut terminated, mut truncated) =
        (vec![0.0; num_agents], vec![false; num_agents], vec![false; num_agents]);
    let out = StepOut { rewards: &mut rewards, terminated: &mut terminated, truncated: &mut truncated };
    environment.step(&actions, out).unwrap();
    let state: Snapshot = environment.snapshot();
    TraceStep { actions, state, rewards, terminated, truncated, observations: None, metrics: None }
}
