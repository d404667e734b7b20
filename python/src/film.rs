//! Films of episodes, and what is drawn of them.

use pogema_core::{Action, Config, Environment, Error, Instance, Snapshot, TraceStep};
use pogema_fast::Engine;
use pogema_render::{Film, Style, html, svg};
use serde::{Deserialize, Serialize};

/// Keeps the steps of an episode if somebody wants to draw them.
#[derive(Default)]
pub struct Recorder {
    /// Whether the episodes from the next reset on are kept.
    pub is_wanted: bool,
    film: Option<Film>,
}

/// The states of a film; a snapshot does not hold its step, so the numbers of the steps stand beside them.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kept {
    start: Snapshot,
    steps: Vec<TraceStep>,
    numbers: Vec<u64>,
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

    /// What is needed besides the instance to go on with the film.
    pub fn kept(&self) -> Option<Kept> {
        let film = self.film.as_ref()?;
        let numbers = film.steps.iter().map(|step| step.state.step).collect();
        Some(Kept { start: film.start.clone(), steps: film.steps.clone(), numbers })
    }

    /// Goes on with a film of this instance.
    pub fn resume(&mut self, rules: &Config, instance: &Instance, kept: Kept) {
        let Kept { start, mut steps, numbers } = kept;
        for (step, number) in steps.iter_mut().zip(numbers) {
            step.state.step = number;
        }
        let (map, outside) = (instance.map().clone(), instance.outside().clone());
        self.film = Some(Film { config: *rules, map, outside, start, steps });
    }

    pub fn svg(&self, style: &Style) -> Result<String, Error> {
        svg::draw(self.shown()?, style)
    }

    pub fn html(&self, title: &str) -> Result<String, Error> {
        html::replay(self.shown()?, title)
    }

    pub fn pack(&self) -> Result<String, Error> {
        html::pack(self.shown()?)
    }

    fn shown(&self) -> Result<&Film, Error> {
        let reason = || "no episode is filmed: ask for it before the reset".to_owned();
        self.film.as_ref().ok_or_else(|| Error::State { reason: reason() })
    }
}
