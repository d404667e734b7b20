//! MATS-LP: comparison with a slow search, errors, cancellation and several threads.

mod network;
mod slow;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use pogema_core::{Action, Cell, Config, Episode, Error, GoalStream, Instance, Map, OnGoal, Outside};
use pogema_fast::Engine;
use pogema_numpy::Generator;
use pogema_policies::{Evaluate, Evaluation, MatsLp, MatsLpParams, Prior};
use proptest::prelude::*;

use crate::common;
use network::Linear;
use slow::Slow;

/// The goals of all agents from the current state on, read from the streams of the instance.
struct Ahead {
    streams: Vec<GoalStream>,
    restarts: bool,
}

impl Ahead {
    fn goals(&self, episode: &Episode<Engine>, count: usize) -> Vec<Vec<Cell>> {
        let goals = episode.state().goals;
        if !self.restarts {
            return goals.iter().map(|&goal| vec![goal]).collect();
        }
        let list = |(stream, &goal): (&GoalStream, &Cell)| {
            let mut stream = stream.clone();
            let mut known = vec![goal];
            while known.len() < count {
                let last = known[known.len() - 1];
                known.push(stream.advance(last));
            }
            known
        };
        self.streams.iter().zip(goals).map(list).collect()
    }

    fn follow(&mut self, episode: &Episode<Engine>) {
        if self.restarts {
            for (agent, stream) in self.streams.iter_mut().enumerate() {
                if episode.state().on_goal[agent] {
                    stream.advance(episode.state().cells[agent]);
                }
            }
        }
    }
}

fn yaml(seed: u64, side: usize, agents: usize, density: f64, on_target: OnGoal) -> String {
    format!(
        "{{seed: {seed}, size: {side}, num_agents: {agents}, density: {density}, on_target: {on_target}, \
         collision_system: soft, max_episode_steps: 64}}"
    )
}

fn same_as_slow(yaml: &str, network: &Linear, params: MatsLpParams, steps: usize) -> Result<(), Error> {
    let mut episode = common::start(yaml)?;
    let (map, on_goal) = (episode.instance()?.map().clone(), episode.config().on_goal);
    let mut ahead =
        Ahead { streams: episode.instance()?.goals().to_vec(), restarts: on_goal == OnGoal::Restart };
    let radius = network.radius();
    let network_copy = network.clone();
    let (best, roots) = (Vec::new(), Vec::new());
    let mut slow = Slow { network: network_copy, params, radius, map: &map, on_goal, best, roots };
    let mut policy = MatsLp::new(network, params, 2)?;
    policy.begin(episode.instance()?, on_goal);
    for step in 0..steps {
        let expected = slow.act(episode.state(), &ahead.goals(&episode, params.expansions as usize + 1));
        let actions = policy.act(episode.state())?;
        assert_eq!(actions, expected, "step {step} of {yaml}");
        // Visits and sums show deviations that are too small to change an action.
        for (agent, root) in slow.roots.iter().enumerate() {
            assert_eq!(policy.root(agent), root, "root of agent {agent} in step {step} of {yaml}");
        }
        episode.step(&actions)?;
        ahead.follow(&episode);
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_search_equals_the_slow_one(
        seed in 0_u64..1000,
        side in 3_usize..8,
        agents in 1_usize..6,
        density in prop::sample::select(vec![0.0, 0.2, 0.4]),
        on_target in prop::sample::select(vec![OnGoal::Restart, OnGoal::Restart, OnGoal::Finish, OnGoal::Nothing]),
        radius in 1_usize..6,
        scale in prop::sample::select(vec![0.0, 0.3, 1.0, 3.0]),
        expansions in 1_u32..200,
        agents_to_plan in 1_usize..4,
        merging_range in 2_u32..7,
        faithful: bool,
    ) {
        let yaml = yaml(seed, side, agents.min(side), density, on_target);
        // A map may have no room for all agents.
        prop_assume!(common::start(&yaml).is_ok());
        let params = MatsLpParams { expansions, agents_to_plan, merging_range, faithful, ..MatsLpParams::default() };
        let network = Linear::new(radius, scale, &mut Generator::seeded(seed));
        prop_assert_eq!(same_as_slow(&yaml, &network, params, 6), Ok(()));
    }
}

#[test]
fn the_search_equals_the_slow_one_with_the_published_number_of_expansions() -> Result<(), Error> {
    for faithful in [true, false] {
        let params = MatsLpParams { faithful, ..MatsLpParams::default() };
        let network = Linear::new(5, 1.0, &mut Generator::seeded(7));
        same_as_slow(&yaml(7, 6, 4, 0.2, OnGoal::Restart), &network, params, 4)?;
    }
    Ok(())
}

/// Plays an episode and returns all actions.
fn play(threads: usize, params: MatsLpParams) -> Result<Vec<Vec<Action>>, Error> {
    let mut episode = common::start(&yaml(3, 12, 24, 0.2, OnGoal::Restart))?;
    let mut policy = MatsLp::new(&Linear::new(5, 1.0, &mut Generator::seeded(3)), params, threads)?;
    policy.begin(episode.instance()?, OnGoal::Restart);
    let mut all = Vec::new();
    for _ in 0..12 {
        let actions = policy.act(episode.state())?;
        episode.step(&actions)?;
        all.push(actions);
    }
    Ok(all)
}

#[test]
fn the_number_of_threads_changes_nothing() -> Result<(), Error> {
    let params = MatsLpParams { expansions: 60, ..MatsLpParams::default() };
    let alone = play(1, params)?;
    assert!(alone.iter().flatten().any(|&action| action != Action::Stay));
    for threads in [2, 8, 32] {
        assert_eq!(play(threads, params)?, alone, "{threads} threads");
    }
    Ok(())
}

fn instance(rows: &[&str], starts: &[[u16; 2]], goals: &[[u16; 2]]) -> Result<Instance, Error> {
    let goals = goals.iter().map(|&goal| GoalStream::single(goal.into())).collect();
    let starts = starts.iter().map(|&start| start.into()).collect();
    Instance::new(Map::from_rows(rows)?, Outside::Free, starts, goals)
}

fn start(instance: Instance, on_goal: OnGoal) -> Result<Episode<Engine>, Error> {
    let collision = pogema_core::Collision::Soft;
    let config = Config { num_agents: instance.starts().len(), on_goal, collision, ..Config::default() };
    let mut episode = Episode::new(Engine::new(config)?);
    episode.start(instance)?;
    Ok(episode)
}

/// If the network prefers no action, the reward alone leads an agent to its goal, and the first of equal actions is
/// taken.
#[test]
fn an_agent_with_a_uniform_network_still_reaches_its_goal() -> Result<(), Error> {
    let network = Linear::new(5, 0.0, &mut Generator::seeded(0));
    for faithful in [true, false] {
        let mut episode = start(instance(&["....."], &[[0, 0]], &[[0, 4]])?, OnGoal::Finish)?;
        let mut policy = MatsLp::new(&network, MatsLpParams { faithful, ..MatsLpParams::default() }, 1)?;
        policy.begin(episode.instance()?, OnGoal::Finish);
        let mut num_steps = 0;
        while episode.state().active[0] && num_steps < 12 {
            let actions = policy.act(episode.state())?;
            episode.step(&actions)?;
            num_steps += 1;
        }
        assert!(!episode.state().active[0], "faithful {faithful}: {:?}", episode.state());
        let actions = policy.act(episode.state())?;
        assert_eq!(actions, [Action::Stay], "an inactive agent stays");
    }
    Ok(())
}

#[test]
fn agents_without_a_path_or_on_isolated_cells_play_on() -> Result<(), Error> {
    let rows = ["..#.#", "..###", "###.."];
    let made = instance(&rows, &[[0, 3], [0, 0], [2, 4]], &[[0, 3], [2, 3], [2, 3]])?;
    let mut episode = start(made, OnGoal::Restart)?;
    let mut policy =
        MatsLp::new(&Linear::new(5, 1.0, &mut Generator::seeded(1)), MatsLpParams::default(), 1)?;
    policy.begin(episode.instance()?, OnGoal::Restart);
    for _ in 0..3 {
        let actions = policy.act(episode.state())?;
        assert_eq!(actions[0], Action::Stay, "nothing else is possible on an isolated cell");
        episode.step(&actions)?;
    }
    Ok(())
}

#[test]
fn wrong_calls_are_rejected() -> Result<(), Error> {
    let network = Linear::new(5, 1.0, &mut Generator::seeded(1));
    let episode = start(instance(&["..."], &[[0, 0]], &[[0, 2]])?, OnGoal::Finish)?;
    let mut policy = MatsLp::new(&network, MatsLpParams::default(), 1)?;
    assert_eq!(policy.act(episode.state()), Err(Error::NotReset));
    policy.begin(episode.instance()?, OnGoal::Finish);
    policy.act(episode.state())?;
    let again = policy.act(episode.state()).map_err(|error| error.to_string());
    assert_eq!(again, Err("found the state of step 0, expected step 1 of the same episode".into()));
    let message = |made: Result<MatsLp, Error>| made.err().map(|error| error.to_string());
    let wide = Linear::new(8, 1.0, &mut Generator::seeded(1));
    let made = MatsLp::new(&wide, MatsLpParams::default(), 1);
    assert_eq!(message(made), Some("`radius of the network` is `8`, expected 1 to 7".into()));
    let made = MatsLp::new(&network, MatsLpParams::default(), 0);
    assert_eq!(message(made), Some("`threads` is `0`, expected 1 to 1024".into()));
    let made = MatsLp::new(&network, MatsLpParams { expansions: 0, ..MatsLpParams::default() }, 1);
    assert_eq!(message(made), Some("`expansions` is `0`, expected 1 to 100000".into()));
    Ok(())
}

/// A faulty network. With a flag, it sets the flag from its fifth call on; otherwise it returns NaN for an agent in the
/// last column.
#[derive(Clone)]
struct Faulty {
    calls: Arc<AtomicUsize>,
    flag: Option<Arc<AtomicBool>>,
    critic: bool,
}

impl Prior for Faulty {
    fn radius(&self) -> usize {
        1
    }

    fn has_critic(&self) -> bool {
        self.critic
    }

    fn evaluator(&self) -> Box<dyn Evaluate> {
        Box::new(self.clone())
    }
}

impl Evaluate for Faulty {
    fn evaluate(&mut self, inputs: &[f32], out: &mut [Evaluation]) -> Result<(), Error> {
        let calls = self.calls.fetch_add(1, Ordering::Relaxed) + 1;
        if let Some(flag) = &self.flag {
            flag.store(calls >= 5, Ordering::Relaxed);
        }
        for (input, out) in inputs.chunks_exact(18).zip(out) {
            // For an agent in the last column, all cells to the right have the value of a wall.
            let is_last = [11, 14, 17].iter().all(|&index| input[index] == 0.0);
            out.logits[4] = if self.flag.is_none() && is_last { f32::NAN } else { 0.5 };
        }
        Ok(())
    }
}

fn faulty(flag: Option<&Arc<AtomicBool>>) -> Faulty {
    Faulty { calls: Arc::default(), flag: flag.cloned(), critic: false }
}

#[test]
fn errors_about_nan_logits_name_agent_and_step() -> Result<(), Error> {
    let rows = [".....", ".....", "....."];
    for threads in [1, 2, 8] {
        let made = instance(&rows, &[[0, 0], [1, 0], [2, 2]], &[[0, 1], [1, 1], [2, 4]])?;
        let mut episode = start(made, OnGoal::Restart)?;
        // With one expansion, a search evaluates only its root.
        let params = MatsLpParams { expansions: 1, merging_range: 1, ..MatsLpParams::default() };
        let mut policy = MatsLp::new(&faulty(None), params, threads)?;
        policy.begin(episode.instance()?, OnGoal::Restart);
        for _ in 0..2 {
            policy.act(episode.state())?;
            episode.step(&[Action::Stay, Action::Stay, Action::Right])?;
        }
        let error = policy.act(episode.state()).map_err(|error| error.to_string());
        assert_eq!(error, Err("network: its outputs for agent 2 in step 2 are not finite".into()));
        let made = instance(&rows, &[[0, 0], [1, 4], [2, 4]], &[[0, 1], [1, 1], [2, 1]])?;
        let episode = start(made, OnGoal::Finish)?;
        policy.begin(episode.instance()?, OnGoal::Finish);
        let error = policy.act(episode.state()).map_err(|error| error.to_string());
        assert_eq!(error, Err("network: its outputs for agent 1 in step 0 are not finite".into()));
    }
    Ok(())
}

#[test]
fn a_flag_cancels_a_search() -> Result<(), Error> {
    let flag = Arc::new(AtomicBool::new(false));
    let network = faulty(Some(&flag));
    let episode = start(instance(&["....", "...."], &[[0, 0]], &[[0, 2]])?, OnGoal::Restart)?;
    let mut policy =
        MatsLp::new(&network, MatsLpParams::default(), 1)?.with_cancellation(Some(Arc::clone(&flag)));
    policy.begin(episode.instance()?, OnGoal::Restart);
    assert_eq!(policy.act(episode.state()), Err(Error::Cancelled));
    assert_eq!(network.calls.load(Ordering::Relaxed), 5);
    Ok(())
}

#[test]
fn the_memory_of_searches_does_not_grow_with_the_number_of_agents() -> Result<(), Error> {
    let network = Linear::new(2, 1.0, &mut Generator::seeded(1));
    // The trees take most of the memory if many agents are planned together.
    let params = MatsLpParams { expansions: 8, agents_to_plan: 5, ..MatsLpParams::default() };
    let peak = |side: usize, num_agents: usize| -> Result<u64, Error> {
        let episode = common::start(&yaml(7, side, num_agents, 0.0, OnGoal::Nothing))?;
        let mut policy = MatsLp::new(&network, params, 1)?;
        policy.begin(episode.instance()?, OnGoal::Nothing);
        let mut acted = Err(Error::NotReset);
        let memory = allocation_counter::measure(|| acted = policy.act(episode.state()));
        acted.map(|_| memory.bytes_max)
    };
    let (few, many) = (peak(16, 80)?, peak(32, 320)?);
    assert!(many < 2 * few, "{few} bytes with 80 agents, {many} with 320");
    Ok(())
}

#[test]
fn the_search_of_the_paper_requires_a_critic() {
    let params = MatsLpParams { faithful: false, ..MatsLpParams::default() };
    let made = MatsLp::new(&faulty(None), params, 1).err().map(|error| error.to_string());
    assert_eq!(made, Some("`faithful` is `false`, expected true, because the network has no critic".into()));
}
