//! Agent steps per second of batches by the number of threads, on an idle machine and while one other thread is busy.
//!
//! `cargo bench -p pogema-benches --bench batches [-- SECONDS]` prints the median of three runs of SECONDS each
//! [default: 0.5].

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a bench may panic and prints its table")]

use std::hint::spin_loop;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::thread::scope;
use std::time::Instant;

use pogema_benches::episode;
use pogema_core::{Action, StepOut};
use pogema_fast::{Batch, Observations, words_per_agent};
use pogema_numpy::Generator;
use pogema_planners::sample;

/// Lanes and agents per lane.
const SIZES: [(usize, usize); 11] = [
    (1, 64),
    (32, 1),
    (8, 8),
    (16, 8),
    (32, 8),
    (64, 8),
    (128, 8),
    (16, 64),
    (64, 64),
    (256, 64),
    (1024, 64),
];
const THREADS: [usize; 2] = [1, 2];
const SIDE: usize = 32;
const NUM_ACTIONS: usize = 16;
const NUM_RUNS: usize = 3;

/// A form of observations.
#[derive(Clone, Copy, Debug)]
enum Form {
    None,
    F32,
    U8,
    Bits,
}

/// A batch with its buffers.
struct Player {
    batch: Batch,
    form: Form,
    actions: Vec<Vec<Action>>,
    rewards: Vec<f32>,
    terminated: Vec<bool>,
    truncated: Vec<bool>,
    floats: Vec<f32>,
    bytes: Vec<u8>,
    words: Vec<u64>,
    step: usize,
}

impl Player {
    fn new(num_lanes: usize, num_agents: usize, num_threads: usize, form: Form) -> Self {
        let (config, _) = episode(SIDE, num_agents, 0).unwrap();
        let source =
            move |lane, number| Ok(episode(SIDE, num_agents, lane as u64 + 10_000 * number).unwrap().1);
        let mut batch = Batch::new(config, num_lanes, num_threads, source).unwrap();
        batch.reset().unwrap();
        let all = num_lanes * num_agents;
        let mut generator = Generator::seeded(0);
        let room = |wanted: bool, size: usize| if wanted { size } else { 0 };
        let num_values = num_lanes * config.num_observed();
        Self {
            batch,
            form,
            actions: (0..NUM_ACTIONS).map(|_| sample(&mut generator, all)).collect(),
            rewards: vec![0.0; all],
            terminated: vec![false; all],
            truncated: vec![false; all],
            floats: vec![0.0; room(matches!(form, Form::F32), num_values)],
            bytes: vec![0; room(matches!(form, Form::U8), num_values)],
            words: vec![0; room(matches!(form, Form::Bits), all * words_per_agent(config.radius))],
            step: 0,
        }
    }

    fn step(&mut self) {
        self.step += 1;
        let Self { rewards, terminated, truncated, .. } = self;
        let out = StepOut { rewards, terminated, truncated };
        let observations = match self.form {
            Form::None => Observations::None,
            Form::F32 => Observations::F32(&mut self.floats),
            Form::U8 => Observations::U8(&mut self.bytes),
            Form::Bits => Observations::Bits(&mut self.words),
        };
        self.batch.step(&self.actions[self.step % NUM_ACTIONS], out, observations).unwrap();
    }

    /// Returns millions of agent steps per second.
    fn speed(&mut self, seconds: f64) -> f64 {
        let (start, mut num_steps) = (Instant::now(), 0);
        while start.elapsed().as_secs_f64() < seconds {
            for _ in 0..8 {
                self.step();
            }
            num_steps += 8;
        }
        (num_steps * self.rewards.len()) as f64 / start.elapsed().as_secs_f64() / 1e6
    }

    fn median(&mut self, seconds: f64) -> f64 {
        let mut speeds: Vec<f64> = (0..NUM_RUNS).map(|_| self.speed(seconds)).collect();
        speeds.sort_by(f64::total_cmp);
        speeds[NUM_RUNS / 2]
    }
}

fn main() {
    let seconds = std::env::args().find_map(|argument| argument.parse().ok()).unwrap_or(0.5);
    println!(
        "million agent steps per second, {SIDE} x {SIDE}; threads: {THREADS:?}, then while another thread is busy"
    );
    for form in [Form::F32, Form::U8, Form::Bits, Form::None] {
        for (num_lanes, num_agents) in SIZES {
            let mut players = THREADS.map(|threads| Player::new(num_lanes, num_agents, threads, form));
            let idle: Vec<f64> = players.iter_mut().map(|player| player.median(seconds)).collect();
            let is_over = AtomicBool::new(false);
            let busy: Vec<f64> = scope(|scope| {
                scope.spawn(|| {
                    while !is_over.load(Relaxed) {
                        spin_loop();
                    }
                });
                let speeds = players.iter_mut().map(|player| player.median(seconds)).collect();
                is_over.store(true, Relaxed);
                speeds
            });
            let text =
                |speeds: &[f64]| speeds.iter().map(|one| format!("{one:7.1}")).collect::<Vec<_>>().concat();
            println!("{form:?} {num_lanes:>5} x {num_agents:<3} {} |{}", text(&idle), text(&busy));
        }
    }
}
