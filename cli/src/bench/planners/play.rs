//! One episode of a set, planned, checked and played on the reference engine.

use std::time::{Duration, Instant};

use pogema_core::{Action, Episode, Error, Instance, Metrics, State, Words};
use pogema_maps::{GridConfig, InstanceSource};
use pogema_planners::{LifelongName, LifelongPolicy, Outcome, PlannerName, PlannerPolicy, validate};
use pogema_reference::Reference;

use crate::plan::Thinking;

/// What came of an episode.
pub struct Played {
    pub metrics: Metrics,
    /// Time that was spent on planning.
    pub runtime: Duration,
    /// Moves that the engine took back; a valid plan has none.
    pub num_reverted: u64,
    /// The least that any plan's sum of costs can be, as far as the planner knows.
    pub bound: Option<u64>,
    /// Why there is no plan, if that was proved.
    pub impossible: Option<String>,
}

/// Plays an episode to its end.
pub fn play(
    config: &GridConfig,
    mut act: impl FnMut(&Instance, State<'_>) -> Result<Vec<Action>, Error>,
) -> Result<Played, Error> {
    let instance = InstanceSource::new(config.clone(), None)?.generate()?.instance;
    let mut episode = Episode::new(Reference::new(config.rules())?).with_collisions();
    episode.start(instance)?;
    let mut runtime = Duration::ZERO;
    while !episode.is_over() {
        let began = Instant::now();
        let actions = act(episode.instance()?, episode.state())?;
        runtime += began.elapsed();
        episode.step(&actions)?;
    }
    let metrics = episode.metrics();
    let num_reverted = (metrics.a_collisions.unwrap_or(0.0) + metrics.o_collisions.unwrap_or(0.0)) as u64;
    let metrics = Metrics { a_collisions: None, o_collisions: None, ..metrics };
    Ok(Played { metrics, runtime, num_reverted, bound: None, impossible: None })
}

/// Plays an episode of one goal for each agent; its plan, if it is whole, has to be valid and to come true.
pub fn play_once(config: &GridConfig, name: &str, thinking: &Thinking) -> Result<Played, Error> {
    let most_steps = u64::try_from(config.max_episode_steps).ok();
    let mut policy = PlannerPolicy::new(
        PlannerName::read("planner", name)?.make(thinking.choice()),
        thinking.budget()?,
        most_steps,
    );
    let mut task = None;
    let mut played = play(config, |instance, now| {
        task.get_or_insert_with(|| (instance.map().clone(), now.cells.to_vec(), now.goals.to_vec()));
        // It is asked for one plan, which it either finds or not.
        let has_none = |outcome: &Outcome| outcome.best().is_none();
        if policy.outcomes().first().is_some_and(has_none) {
            return Ok(vec![Action::Stay; now.cells.len()]);
        }
        policy.act(instance.map(), now)
    })?;
    let outcome = policy.outcomes().first();
    if let (Some((map, starts, goals)), Some(Outcome::Solved { plan, .. })) = (task, outcome) {
        let wrong = |reason: String| Error::Plan { reason: format!("a plan is wrong: {reason}") };
        validate(&map, &starts, Some(&goals), plan).map_err(|conflict| wrong(conflict.to_string()))?;
        if played.num_reverted > 0 || policy.outcomes().len() > 1 {
            return Err(wrong(format!("the engine took {} moves back", played.num_reverted)));
        }
    }
    played.bound = outcome.and_then(Outcome::lower_bound);
    if let Some(Outcome::Impossible { reason }) = outcome {
        played.impossible = Some(reason.clone());
    }
    Ok(played)
}

/// Plays an episode of goal after goal, all of which the planner may be told of from the beginning; no move of it may
/// be taken back.
pub fn play_on(
    config: &GridConfig,
    name: &str,
    thinking: &Thinking,
    future_goals: bool,
) -> Result<Played, Error> {
    let mut policy =
        LifelongPolicy::new(LifelongName::read("planner", name)?, thinking.choice(), thinking.budget()?);
    let played = play(config, |instance, now| {
        if future_goals && now.step == 0 {
            policy.provide_future_goals(instance)?;
        }
        policy.act(instance.map(), now)
    })?;
    if played.num_reverted > 0 {
        let reason = format!("a plan is wrong: the engine took {} moves back", played.num_reverted);
        return Err(Error::Plan { reason });
    }
    Ok(played)
}
