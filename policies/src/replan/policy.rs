//! RePlan without a network.

use pogema_core::{Action, Config, Instance, State};
use pogema_numpy::Generator;

use crate::replan::planner::{Plan, ReplanVersion, Replanner};

/// RePlan as a policy: agents in a loop sometimes stay; active agents without a planned move, including those on their
/// goals, stay or move at random.
///
/// All agents of an episode draw from one stream.
#[derive(Clone, Debug)]
pub(crate) struct ReplanPolicy {
    planner: Replanner,
    generator: Generator,
}

impl ReplanPolicy {
    /// Begins an episode. The same seed gives the same actions.
    pub fn begin(instance: &Instance, config: &Config, seed: u64) -> Self {
        let planner = Replanner::begin(ReplanVersion::Python, instance, config.occupancy, config.radius);
        Self { planner, generator: Generator::seeded(seed) }
    }

    /// Returns the actions of all agents in the next state of the episode; inactive agents stay.
    pub fn act(&mut self, state: State<'_>) -> Vec<Action> {
        let mut plans = self.planner.plan(state);
        for plan in &mut plans {
            if let Plan::Return(action) = *plan {
                let stays = self.generator.random() < 0.5;
                *plan = Plan::Move(if stays { Action::Stay } else { action });
            }
        }
        let Self { planner, generator } = self;
        let (layout, obstacles) = planner.obstacles();
        let mut actions = Vec::with_capacity(plans.len());
        for (agent, plan) in plans.into_iter().enumerate() {
            actions.push(match plan {
                Plan::Move(action) | Plan::Return(action) => action,
                Plan::None if state.active[agent] && generator.random() > 0.5 => {
                    let mut moves = Action::MOVES;
                    generator.shuffle(&mut moves);
                    let is_free = |action: &Action| {
                        let (row, col) = state.cells[agent].toward(*action);
                        layout.find_place(row, col).is_some_and(|place| obstacles[place] == 0.0)
                    };
                    moves.into_iter().find(is_free).unwrap_or(Action::Stay)
                }
                Plan::None => Action::Stay,
            });
        }
        actions
    }
}
