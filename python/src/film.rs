//! Films of episodes, and what is drawn of them.

use pogema_core::{Action, Config, Environment, Error, Instance, TraceStep};
use pogema_fast::Engine;
use pogema_render::{Film, Style, html, svg};

/// Keeps the steps of an episode if somebody wants to draw them.
#[derive(Default)]
pub struct Recorder {
    /// Whether the episodes from the next reset on are kept.
    pub is_wanted: bool,
    film: Option<Film>,
}

impl Recorder {
    pub fn begin(&mut self, rules: &Config, instance: &Instance, engine: &Engine) {
        self.film = self.is_wanted.then(|| Film {
            config: *rules,
            map: instance.map().clone(),
            outside: instance.outside().clone(),
            start: engine.snapshot(),
            steps: Vec::new(),
        });
    }

    pub fn step(&mut self, actions: &[Action], engine: &Engine, ends: (&[f32], &[bool], &[bool])) {
        let Some(film) = &mut self.film else { return };
        film.steps.push(TraceStep {
            actions: actions.to_vec(),
            state: engine.snapshot(),
            rewards: ends.0.to_vec(),
            terminated: ends.1.to_vec(),
            truncated: ends.2.to_vec(),
            observations: None,
            metrics: None,
        });
    }

    pub fn svg(&self, style: &Style) -> Result<String, Error> {
        svg::draw(self.shown()?, style)
    }

    pub fn html(&self, title: &str) -> Result<String, Error> {
        html::replay(self.shown()?, title)
    }

    fn shown(&self) -> Result<&Film, Error> {
        let reason = || "no episode is filmed: ask for it before the reset".to_owned();
        self.film.as_ref().ok_or_else(|| Error::State { reason: reason() })
    }
}
