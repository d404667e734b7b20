//! Speed targets of the engine. Most are ratios of two figures of one run.

use serde::Serialize;

use super::Row;

/// A speed target, and the value that this run reached.
#[derive(Clone, Debug, Serialize)]
pub struct Target {
    pub name: String,
    pub want: f64,
    /// The worst value of the measured rows; absent if no row was measured, or if a row lacks a figure.
    pub got: Option<f64>,
    /// Whether `want` is an upper bound.
    pub is_upper_bound: bool,
}

impl Target {
    pub fn is_met(&self) -> Option<bool> {
        self.got.map(|got| if self.is_upper_bound { got <= self.want } else { got >= self.want })
    }
}

/// Returns all speed targets.
pub fn targets(rows: &[Row]) -> Vec<Target> {
    let times = |row: &Row| Some(row.speed.step_f32 / row.pogema?.observations);
    let crowd = |row: &Row| is_paper(row) && row.work.num_agents >= 32;
    let large = |threads| find(rows, 1_000_000, 3072, threads);
    let pogema_at_10_000 = find(rows, 10_000, 256, 1).and_then(|row| Some(row.pogema?.observations));
    let training = find(rows, 64, 32, 1);
    let lanes = |threads| {
        let row = rows.iter().find(|row| row.work.lanes == Some(256) && row.work.threads == threads);
        row.map(|row| row.speed.step_f32)
    };
    let cost = |num_agents, size| find(rows, num_agents, size, 1).map(|row| 1.0 / row.speed.step_f32);
    let least = |name: &str, want, got| Target { name: name.into(), want, got, is_upper_bound: false };
    let most = |name: &str, want, got| Target { name: name.into(), want, got, is_upper_bound: true };
    vec![
        least(
            "step + f32, the paper's rows from 32 agents on: times POGEMA",
            200.0,
            worst(rows, crowd, times),
        ),
        least(
            "step + f32, the paper's rows of 1 agent: times POGEMA",
            100.0,
            worst(rows, |row| is_paper(row) && row.work.num_agents == 1, times),
        ),
        least(
            "f32 alone, buffer in cache: share of the zero-fill rate",
            0.4,
            worst(rows, crowd, |row| Some(row.speed.f32 / row.speed.fill_f32)),
        ),
        least("u8 alone: times f32", 2.0, worst(rows, crowd, |row| Some(row.speed.u8 / row.speed.f32))),
        least(
            "step alone, 64 agents, 32 x 32: times f32",
            2.0,
            training.map(|row| row.speed.step / row.speed.f32),
        ),
        least(
            "1,000,000 agents, 2 threads, step + f32: times POGEMA at 10,000",
            100.0,
            ratio(large(2).map(|row| row.speed.step_f32), pogema_at_10_000),
        ),
        least(
            "1,000,000 agents, 2 threads, step + u8: times POGEMA at 10,000",
            250.0,
            ratio(large(2).map(|row| row.speed.step_u8), pogema_at_10_000),
        ),
        most("1,000,000 agents: seconds for a reset", 1.0, large(1).map(|row| 1.0 / row.speed.reset)),
        most("1,000,000 agents: MB of the engine", 200.0, large(1).map(|row| row.speed.bytes as f64 / 1e6)),
        least("256 lanes, step + f32: 2 threads / 1 thread", 1.8, ratio(lanes(2), lanes(1))),
        least(
            "seeded reset, 64 agents, 32 x 32: times POGEMA",
            100.0,
            training.and_then(|row| Some(row.speed.reset / row.pogema?.resets)),
        ),
        most(
            "step + f32: cost per agent, 100,000 agents / 64 agents",
            3.0,
            ratio(cost(100_000, 3072), cost(64, 32)),
        ),
    ]
}

fn is_paper(row: &Row) -> bool {
    row.work.lanes.is_none() && row.work.num_agents <= 64
}

fn find(rows: &[Row], num_agents: usize, size: usize, threads: usize) -> Option<&Row> {
    rows.iter().find(|row| {
        let work = &row.work;
        work.lanes.is_none() && (work.num_agents, work.size, work.threads) == (num_agents, size, threads)
    })
}

/// Returns the smallest figure of the selected rows, if all of them have one.
fn worst(
    rows: &[Row],
    is_selected: impl Fn(&Row) -> bool,
    figure: impl Fn(&Row) -> Option<f64>,
) -> Option<f64> {
    let figures: Option<Vec<f64>> = rows.iter().filter(|row| is_selected(row)).map(figure).collect();
    figures?.into_iter().reduce(f64::min)
}

fn ratio(ours: Option<f64>, theirs: Option<f64>) -> Option<f64> {
    Some(ours? / theirs?)
}
