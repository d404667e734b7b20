//! Steps 256 lifelong environments, and counts goals and episodes.
//!
//! When an episode ends, the next one starts automatically.

use pogema::{Action, Error, GridConfig, Observations, StepResults};

const NUM_ENVS: usize = 256;
const NUM_STEPS: usize = 200;

pub(crate) fn main() -> Result<(), Error> {
    let config =
        GridConfig::from_yaml("{size: 16, num_agents: 8, on_target: restart, max_episode_steps: 64}")?;
    let mut batch = pogema::batch(&config, NUM_ENVS, 0)?;
    let mut results = StepResults::new(NUM_ENVS * config.num_agents);
    // Shape: [envs, agents, 3, side, side]
    let mut seen = vec![0_u8; NUM_ENVS * batch.config().num_observed()];
    batch.reset()?;
    batch.observe(Observations::U8(&mut seen))?;
    let (mut num_goals, mut num_episodes) = (0.0, 0);
    for step in 0..NUM_STEPS {
        let actions: Vec<Action> =
            (0..NUM_ENVS * config.num_agents).map(|agent| Action::ALL[(step + 3 * agent) % 5]).collect();
        batch.step(&actions, results.out(), Observations::U8(&mut seen))?;
        num_goals += results.rewards.iter().sum::<f32>();
        for env in 0..NUM_ENVS {
            num_episodes += usize::from(batch.has_just_ended(env)?);
        }
    }
    println!("{num_goals} goals, {num_episodes} episodes");
    assert_eq!(num_episodes, NUM_ENVS * (NUM_STEPS / 64));
    Ok(())
}
