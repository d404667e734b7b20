//! Shrinking of counterexamples, so that they are easy to understand.

use pogema_core::Observation;
use serde_json::json;

use super::claims::Mode;
use super::group::Example;
use super::subject::Worker;
use super::test_episode::TestEpisode;
use crate::play::play;
use crate::request::{Op, Request, Response};
use crate::runner::Watch;

/// The remaining plays for shrinking the occurrences of one group.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// Requests that may still be played.
    plays: usize,
    /// Misbehaviours that may still occur; after each, the port is started again.
    restarts: usize,
    /// Missing answers that may still occur; each costs the time limit.
    hangs: usize,
}

impl Budget {
    /// The budget of one group.
    pub const FULL: Self = Self { plays: 12_000, restarts: 150, hangs: 30 };

    /// Returns whether nothing more can be played.
    pub fn is_spent(self) -> bool {
        self.plays == 0 || self.restarts == 0 || self.hangs == 0
    }
}

/// Shrinks an example while it shows the same cause. Ends if no simplification succeeds, the budget is spent or the run
/// is stopped.
pub fn shrink(worker: &mut Worker<'_>, example: &Example, budget: &mut Budget, watch: Watch<'_>) -> Example {
    let mut shrinker = Shrinker { worker, best: example.clone(), budget, watch };
    if let Some(op) = example.op() {
        shrinker.shrink_until(op);
    }
    shrinker.best
}

pub struct Shrinker<'a, 'w> {
    worker: &'a mut Worker<'w>,
    pub best: Example,
    budget: &'a mut Budget,
    watch: Watch<'a>,
}

impl Shrinker<'_, '_> {
    /// Removes the operations after `until`, then everything else that the cause does not need.
    fn shrink_until(&mut self, until: usize) {
        let mut cut = self.best.request.clone();
        cut.ops.truncate(until + 1);
        self.accept(&cut);
        if !self.shrink_as_episode() {
            self.shrink_config();
            // With fewer fields, an explicit episode may show the cause, too.
            self.shrink_as_episode();
        }
    }

    /// Shrinks the explicit episode that the best request plays; returns false if that episode does not show
    /// the cause.
    fn shrink_as_episode(&mut self) -> bool {
        let (request, op) = (self.best.request.clone(), self.best.op().unwrap_or_default());
        let Some(episode) = TestEpisode::of(&request, &play(&request), op) else { return false };
        let before = self.best.mode;
        for mode in [Mode::Instance, Mode::Config] {
            self.best.mode = mode;
            if self.accept(&episode.request()) {
                self.shrink_episode(episode);
                return true;
            }
        }
        self.best.mode = before;
        false
    }

    /// Returns whether shrinking must end.
    pub fn is_done(&self) -> bool {
        self.budget.is_spent() || self.watch.is_stopped()
    }

    /// Makes a request the new best if it shows the same cause.
    pub fn accept(&mut self, request: &Request) -> bool {
        // A misbehaviour gives no information about another cause, and a port may misbehave only sometimes.
        const MAX_TRIES: usize = 2;
        let expected = play(request);
        let may_be_refused = self.best.divergence.as_ref().is_none_or(|found| found.field.name == "error");
        if expected.error.is_some() && !may_be_refused {
            return false;
        }
        for _ in 0..MAX_TRIES {
            if self.is_done() {
                return false;
            }
            self.budget.plays -= 1;
            let judged = self.worker.judge(self.best.mode, request, &expected);
            let fault = judged.fault.clone();
            if let Some(fault) = &fault {
                self.budget.restarts -= 1;
                self.budget.hangs -= usize::from(fault.is_hang());
            }
            let mut examples = Example::all_of(&self.best.name, self.best.mode, judged);
            if let Some(like) = examples.find(|example| example.is_like(&self.best)) {
                self.best = like;
                return true;
            }
            if fault.is_none() {
                return false;
            }
        }
        false
    }

    fn shrink_episode(&mut self, mut episode: TestEpisode) {
        loop {
            let before = episode.clone();
            self.start_later(&mut episode);
            self.drop_agents(&mut episode);
            self.drop_lines(&mut episode);
            self.drop_steps(&mut episode);
            self.simplify_fields(&mut episode);
            self.clear_obstacles(&mut episode);
            self.simplify_actions(&mut episode);
            self.shorten_sequences(&mut episode);
            if episode == before || self.is_done() {
                return;
            }
        }
    }

    fn try_episode(&mut self, episode: &mut TestEpisode, candidate: TestEpisode) -> bool {
        let is_accepted = candidate != *episode && self.accept(&candidate.request());
        if is_accepted {
            *episode = candidate;
        }
        is_accepted
    }

    /// Begins the episode as late as possible, at best just before the difference.
    fn start_later(&mut self, episode: &mut TestEpisode) {
        let played: Response = play(&episode.request());
        for num_ops in (1..episode.ops.len()).rev() {
            let Some(later) = episode.begun_after(num_ops, &played) else { continue };
            if self.try_episode(episode, later) {
                return;
            }
        }
    }

    fn drop_agents(&mut self, episode: &mut TestEpisode) {
        let mut size = episode.num_agents() / 2;
        while size > 0 {
            let mut first = 0;
            while first < episode.num_agents() && episode.num_agents() > 1 {
                let gone: Vec<usize> = (first..(first + size).min(episode.num_agents())).collect();
                let fewer = episode.without_agents(&gone);
                if fewer.num_agents() == 0 || !self.try_episode(episode, fewer) {
                    first += size;
                }
            }
            size /= 2;
        }
    }

    fn drop_lines(&mut self, episode: &mut TestEpisode) {
        for row in (0..episode.rows.len()).rev() {
            if episode.rows.len() > 1 {
                let smaller = episode.without_row(row);
                self.try_episode(episode, smaller);
            }
        }
        for col in (0..episode.rows[0].len()).rev() {
            if episode.rows[0].len() > 1 {
                let smaller = episode.without_col(col);
                self.try_episode(episode, smaller);
            }
        }
    }

    /// Removes steps, and shortens the episode limit accordingly if necessary.
    fn drop_steps(&mut self, episode: &mut TestEpisode) {
        for at in (0..episode.ops.len()).rev() {
            let mut shorter = episode.clone();
            shorter.ops.remove(at);
            if self.try_episode(episode, shorter.clone()) {
                continue;
            }
            shorter.set_max_steps(episode.max_steps().saturating_sub(1));
            self.try_episode(episode, shorter);
        }
    }

    fn simplify_fields(&mut self, episode: &mut TestEpisode) {
        for name in
            ["empty_outside", "persistent", "occupancy", "reward", "observation_type", "max_episode_steps"]
        {
            let mut simpler = episode.clone();
            simpler.fields.remove(name);
            if name == "empty_outside" {
                // Only noise needs the seed.
                simpler.fields.remove("seed");
            }
            self.try_episode(episode, simpler);
        }
        for (name, value) in [
            ("max_episode_steps", json!(episode.ops.len())),
            ("observation_type", json!(Observation::Pomapf)),
        ] {
            if episode.fields.contains_key(name) {
                let mut simpler = episode.clone();
                simpler.fields.insert(name.into(), value);
                self.try_episode(episode, simpler);
            }
        }
        for radius in 1..5 {
            let mut simpler = episode.clone();
            simpler.fields.insert("obs_radius".into(), radius.into());
            if episode.fields.get("obs_radius") == Some(&radius.into()) || self.try_episode(episode, simpler)
            {
                break;
            }
        }
        let unseeded = TestEpisode { reset_seed: None, ..episode.clone() };
        self.try_episode(episode, unseeded);
        let plain = TestEpisode { density: false, collisions: false, ..episode.clone() };
        self.try_episode(episode, plain);
    }

    fn clear_obstacles(&mut self, episode: &mut TestEpisode) {
        let mut clear = episode.clone();
        clear.rows.iter_mut().for_each(|row| row.fill(false));
        if self.try_episode(episode, clear) {
            return;
        }
        for row in 0..episode.rows.len() {
            for col in 0..episode.rows[row].len() {
                if episode.rows[row][col] {
                    let mut fewer = episode.clone();
                    fewer.rows[row][col] = false;
                    self.try_episode(episode, fewer);
                }
            }
        }
    }

    fn simplify_actions(&mut self, episode: &mut TestEpisode) {
        for at in 0..episode.ops.len() {
            for agent in 0..episode.num_agents() {
                let mut simpler = episode.clone();
                if let Op::Step(actions) = &mut simpler.ops[at]
                    && actions.get(agent).is_some_and(|&action| action != 0)
                {
                    actions[agent] = 0;
                    self.try_episode(episode, simpler);
                }
            }
        }
    }

    fn shorten_sequences(&mut self, episode: &mut TestEpisode) {
        for agent in 0..episode.num_agents() {
            while episode.goals[agent].len() > 2 {
                let mut simpler = episode.clone();
                simpler.goals[agent].pop();
                if !self.try_episode(episode, simpler) {
                    break;
                }
            }
        }
    }
}
