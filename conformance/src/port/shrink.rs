//! Makes a counterexample small enough to be understood at a glance.

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

/// So often a port is asked to play for one counterexample.
const MOST_PLAYS: usize = 4000;

/// An example made smaller, and whether the port misbehaved meanwhile and has to be started again.
pub struct Shrunk {
    pub example: Example,
    pub has_faulted: bool,
}

/// Makes an example smaller as long as it shows the same cause.
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
    /// Leaves out what comes after an operation, and then whatever else it can.
    fn shrink_until(&mut self, until: usize) {
        let request = self.best.request.clone();
        let expected = play(&request);
        let mut cut = request.clone();
        cut.ops.truncate(until + 1);
        self.accept(&cut);
        if let Some(scene) = TestEpisode::of(&request, &expected, until) {
            for mode in [Mode::Instance, Mode::Config] {
                let before = self.best.mode;
                self.best.mode = mode;
                if self.accept(&scene.request()) {
                    return self.shrink_scene(scene);
                }
                self.best.mode = before;
            }
        }
        self.shrink_config();
    }

    /// Whether nothing more can be learned.
    pub fn is_done(&self) -> bool {
        self.has_faulted || self.plays >= MOST_PLAYS
    }

    /// Takes a request as the new best if it shows the same cause.
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

    fn shrink_scene(&mut self, mut scene: TestEpisode) {
        loop {
            let before = scene.clone();
            self.start_later(&mut scene);
            self.drop_agents(&mut scene);
            self.drop_lines(&mut scene);
            self.drop_steps(&mut scene);
            self.simplify_fields(&mut scene);
            self.clear_obstacles(&mut scene);
            self.simplify_actions(&mut scene);
            self.shorten_sequences(&mut scene);
            if scene == before || self.is_done() {
                return;
            }
        }
    }

    fn try_scene(&mut self, scene: &mut TestEpisode, candidate: TestEpisode) -> bool {
        let is_accepted = candidate != *scene && self.accept(&candidate.request());
        if is_accepted {
            *scene = candidate;
        }
        is_accepted
    }

    /// Begins with the state just before the difference, or as late as may be.
    fn start_later(&mut self, scene: &mut TestEpisode) {
        let played: Response = play(&scene.request());
        for num_ops in (1..scene.ops.len()).rev() {
            let Some(later) = scene.begun_after(num_ops, &played) else { continue };
            if self.try_scene(scene, later) {
                return;
            }
        }
    }

    fn drop_agents(&mut self, scene: &mut TestEpisode) {
        let mut size = scene.num_agents() / 2;
        while size > 0 {
            let mut first = 0;
            while first < scene.num_agents() && scene.num_agents() > 1 {
                let gone: Vec<usize> = (first..(first + size).min(scene.num_agents())).collect();
                let fewer = scene.without_agents(&gone);
                if fewer.num_agents() == 0 || !self.try_scene(scene, fewer) {
                    first += size;
                }
            }
            size /= 2;
        }
    }

    fn drop_lines(&mut self, scene: &mut TestEpisode) {
        for row in (0..scene.rows.len()).rev() {
            if scene.rows.len() > 1 {
                let smaller = scene.without_row(row);
                self.try_scene(scene, smaller);
            }
        }
        for col in (0..scene.rows[0].len()).rev() {
            if scene.rows[0].len() > 1 {
                let smaller = scene.without_col(col);
                self.try_scene(scene, smaller);
            }
        }
    }

    /// Leaves out steps, and as many of the steps that the episode may last if it has to be so.
    fn drop_steps(&mut self, scene: &mut TestEpisode) {
        for at in (0..scene.ops.len()).rev() {
            let mut shorter = scene.clone();
            shorter.ops.remove(at);
            if self.try_scene(scene, shorter.clone()) {
                continue;
            }
            let max_steps = scene.fields.get("max_episode_steps").and_then(Value::as_i64).unwrap_or(64);
            shorter.fields.insert("max_episode_steps".into(), (max_steps - 1).max(1).into());
            self.try_scene(scene, shorter);
        }
    }

    fn simplify_fields(&mut self, scene: &mut TestEpisode) {
        for name in ["empty_outside", "persistent", "occupancy", "observation_type", "max_episode_steps"] {
            let mut simpler = scene.clone();
            simpler.fields.remove(name);
            if name == "empty_outside" {
                // Nothing else is drawn.
                simpler.fields.remove("seed");
            }
            self.try_scene(scene, simpler);
        }
        for (name, value) in
            [("max_episode_steps", json!(scene.ops.len())), ("observation_type", json!(Observation::Pomapf))]
        {
            if scene.fields.contains_key(name) {
                let mut simpler = scene.clone();
                simpler.fields.insert(name.into(), value);
                self.try_scene(scene, simpler);
            }
        }
        for radius in 1..5 {
            let mut simpler = scene.clone();
            simpler.fields.insert("obs_radius".into(), radius.into());
            if scene.fields.get("obs_radius") == Some(&radius.into()) || self.try_scene(scene, simpler) {
                break;
            }
        }
        let plain = TestEpisode { density: false, collisions: false, ..scene.clone() };
        self.try_scene(scene, plain);
    }

    fn clear_obstacles(&mut self, scene: &mut TestEpisode) {
        let mut clear = scene.clone();
        clear.rows.iter_mut().for_each(|row| row.fill(false));
        if self.try_scene(scene, clear) {
            return;
        }
        for row in 0..scene.rows.len() {
            for col in 0..scene.rows[row].len() {
                if scene.rows[row][col] {
                    let mut fewer = scene.clone();
                    fewer.rows[row][col] = false;
                    self.try_scene(scene, fewer);
                }
            }
        }
    }

    fn simplify_actions(&mut self, scene: &mut TestEpisode) {
        for at in 0..scene.ops.len() {
            for agent in 0..scene.num_agents() {
                let mut simpler = scene.clone();
                if let Op::Step(actions) = &mut simpler.ops[at]
                    && actions.get(agent).is_some_and(|&action| action != 0)
                {
                    actions[agent] = 0;
                    self.try_scene(scene, simpler);
                }
            }
        }
    }

    fn shorten_sequences(&mut self, scene: &mut TestEpisode) {
        for agent in 0..scene.num_agents() {
            while scene.goals[agent].len() > 2 {
                let mut simpler = scene.clone();
                simpler.goals[agent].pop();
                if !self.try_scene(scene, simpler) {
                    break;
                }
            }
        }
    }
}
