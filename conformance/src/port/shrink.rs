//! Shrinking of counterexamples, so that they are easy to understand.

use pogema_core::Observation;
use serde_json::{Value, json};

use super::claims::Mode;
use super::group::Example;
use super::judge::judge;
use super::link::Link;
use super::protocol::Hello;
use super::test_episode::TestEpisode;
use crate::play::play;
use crate::request::{Op, Request, Response};

/// Maximum number of requests played to shrink one counterexample.
const MAX_PLAYS: usize = 4000;

/// A smaller example, and whether the port misbehaved in the process and must be started again.
pub struct Shrunk {
    pub example: Example,
    pub has_faulted: bool,
}

/// Shrinks an example as long as it shows the same cause.
pub fn shrink(link: &mut dyn Link, hello: &Hello, example: &Example) -> Shrunk {
    let mut shrinker = Shrinker { link, hello, best: example.clone(), plays: 0, has_faulted: false };
    if let Some(divergence) = &example.divergence {
        shrinker.shrink_until(divergence.op);
    }
    Shrunk { example: shrinker.best, has_faulted: shrinker.has_faulted }
}

pub struct Shrinker<'a> {
    link: &'a mut dyn Link,
    hello: &'a Hello,
    pub best: Example,
    plays: usize,
    has_faulted: bool,
}

impl Shrinker<'_> {
    /// Removes the operations after `until`, then everything else that the cause does not need.
    fn shrink_until(&mut self, until: usize) {
        let request = self.best.request.clone();
        let expected = play(&request);
        let mut cut = request.clone();
        cut.ops.truncate(until + 1);
        self.accept(&cut);
        if let Some(episode) = TestEpisode::of(&request, &expected, until) {
            for mode in [Mode::Instance, Mode::Config] {
                let before = self.best.mode;
                self.best.mode = mode;
                if self.accept(&episode.request()) {
                    return self.shrink_episode(episode);
                }
                self.best.mode = before;
            }
        }
        self.shrink_config();
    }

    /// Returns whether shrinking must end.
    pub fn is_done(&self) -> bool {
        self.has_faulted || self.plays >= MAX_PLAYS
    }

    /// Makes a request the new best if it shows the same cause.
    pub fn accept(&mut self, request: &Request) -> bool {
        if self.is_done() {
            return false;
        }
        let expected = play(request);
        let is_about_errors = self.best.divergence.as_ref().is_some_and(|found| found.field.name == "error");
        if expected.error.is_some() && !is_about_errors {
            return false;
        }
        self.plays += 1;
        let judged = judge(self.link, self.hello, self.best.mode, request, &expected);
        self.has_faulted = judged.fault.is_some();
        let examples = judged.divergences.into_iter().map(|found| Example {
            request: request.clone(),
            divergence: Some(found),
            ..self.best.clone()
        });
        let like = examples.into_iter().find(|example| example.is_like(&self.best));
        let is_like = like.is_some();
        self.best = like.unwrap_or_else(|| self.best.clone());
        is_like
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
            let max_steps = episode.fields.get("max_episode_steps").and_then(Value::as_i64).unwrap_or(64);
            shorter.fields.insert("max_episode_steps".into(), (max_steps - 1).max(1).into());
            self.try_episode(episode, shorter);
        }
    }

    fn simplify_fields(&mut self, episode: &mut TestEpisode) {
        for name in ["empty_outside", "persistent", "occupancy", "observation_type", "max_episode_steps"] {
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
