//! An episode as JSON for a page: a readable header, and all long data as packed bytes.
//!
//! The bytes start with the map, with one bit per cell. If there is noise outside the wall of the map, the noise is
//! next, also with one bit per cell. The byte fields of [`Parts`] follow in order, with little-endian multi-byte
//! numbers. The bytes are compressed by zlib and encoded in base64. `episode.js` reads them.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use miniz_oxide::deflate::compress_to_vec_zlib;
use pogema_core::{Action, Cell, Config, Error, Metrics, Outside, Snapshot, Trace, TraceStep};
use serde::Serialize;

use crate::check::check;
use crate::reverted_moves::{Blocker, RevertedMove, reverted_moves};

/// Compression level; higher levels take longer and save almost nothing.
const LEVEL: u8 = 7;

#[derive(Serialize)]
struct Header<'a> {
    height: usize,
    width: usize,
    num_agents: usize,
    num_steps: usize,
    has_noise: bool,
    config: Config,
    metrics: Option<&'a Metrics>,
    /// The distinct reasons of reverted moves; the packed reasons are indices into this list.
    reasons: Vec<Reason>,
    num_goals: usize,
    num_reverted: usize,
    num_others: usize,
    num_marks: usize,
    data: String,
}

#[derive(Clone, Copy, PartialEq, Eq, Serialize)]
struct Reason {
    rule: &'static str,
    cause: &'static str,
}

/// The packed data. Each part is ordered by step, then by agent; marks by step, then by cell.
#[derive(Default)]
struct Parts {
    /// For each agent: start row and col, first goal's row and col (u16).
    starts: Vec<u8>,
    /// For each agent after the reset: 1 if active, plus 2 if on goal.
    flags: Vec<u8>,
    /// For each step and agent: action, plus 8 · move, plus 64 if active, plus 128 if on goal.
    moves: Vec<u8>,
    /// For each step and agent: reward (f32).
    rewards: Vec<u8>,
    /// For each step and agent: 1 if terminated, plus 2 if truncated.
    ended: Vec<u8>,
    /// Goals that changed: step, agent (u32), row, col (u16).
    goals: Vec<u8>,
    /// For each reverted move: index of its reason.
    reverted: Vec<u8>,
    /// For each reverted move with an agent as its cause: that agent (u32).
    others: Vec<u8>,
    /// Cells where the occupancy grid differs from the active agents' cells: step (u32), row, col (u16).
    marks: Vec<u8>,
    reasons: Vec<Reason>,
}

/// Returns the episode as JSON that contains no `<`.
///
/// # Errors
/// Those of [`crate::check()`].
pub fn pack(trace: &Trace) -> Result<String, Error> {
    check(trace)?;
    let num_agents = trace.header.config.num_agents;
    let mut parts = Parts::default();
    parts.add_start(trace);
    let mut before = &trace.start.state;
    for (step, after) in (1..).zip(&trace.steps) {
        parts.add_step(trace, before, after, step);
        before = &after.state;
    }
    let mut bytes = bits(trace.header.map.obstacles());
    let Parts { starts, flags, moves, rewards, ended, goals, reverted, others, marks, reasons } = parts;
    let noise_bits = match &trace.header.outside {
        Outside::Free => Vec::new(),
        Outside::Noise(noise) => bits(noise.obstacles()),
    };
    for part in [&noise_bits, &starts, &flags, &moves, &rewards, &ended, &goals, &reverted, &others, &marks] {
        bytes.extend_from_slice(part);
    }
    let header = Header {
        height: trace.header.map.height(),
        width: trace.header.map.width(),
        num_agents,
        num_steps: trace.steps.len(),
        has_noise: !noise_bits.is_empty(),
        config: trace.header.config,
        metrics: trace.steps.iter().rev().find_map(|step| step.metrics.as_ref()),
        reasons,
        num_goals: goals.len() / 12,
        num_reverted: reverted.len(),
        num_others: others.len() / 4,
        num_marks: marks.len() / 8,
        data: STANDARD.encode(compress_to_vec_zlib(&bytes, LEVEL)),
    };
    serde_json::to_string(&header).map_err(|error| Error::external("JSON", error))
}

impl Parts {
    fn add_start(&mut self, trace: &Trace) {
        let start = &trace.start.state;
        for (cell, goal) in start.cells.iter().zip(&start.goals) {
            put_cell(&mut self.starts, *cell);
            put_cell(&mut self.starts, *goal);
        }
        let flags = start.active.iter().zip(&start.on_goal);
        self.flags = flags.map(|(&active, &on_goal)| u8::from(active) | u8::from(on_goal) << 1).collect();
        self.add_marks(trace, start, 0);
    }

    fn add_step(&mut self, trace: &Trace, before: &Snapshot, step: &TraceStep, at: u32) {
        let after = &step.state;
        for (agent, &action) in step.actions.iter().enumerate() {
            // INVARIANT: the trace is checked, so each agent stays or moves to a neighbouring cell.
            let moved = before.cells[agent].action_to(after.cells[agent]).unwrap_or(Action::Stay);
            let flags = u8::from(after.active[agent]) << 6 | u8::from(after.on_goal[agent]) << 7;
            self.moves.push(action as u8 | (moved as u8) << 3 | flags);
            self.ended.push(u8::from(step.terminated[agent]) | u8::from(step.truncated[agent]) << 1);
            self.rewards.extend(step.rewards[agent].to_le_bytes());
            if before.goals[agent] != after.goals[agent] {
                self.goals.extend(at.to_le_bytes());
                self.goals.extend((agent as u32).to_le_bytes());
                put_cell(&mut self.goals, after.goals[agent]);
            }
        }
        for reverted in reverted_moves(&trace.header.config, &trace.header.map, before, &step.actions, after)
        {
            self.add_reverted(reverted);
        }
        self.add_marks(trace, after, at);
    }

    fn add_reverted(&mut self, reverted: RevertedMove) {
        let reason = Reason { rule: reverted.rule, cause: reverted.blocker.kind() };
        let reason_index = self.reasons.iter().position(|known| *known == reason).unwrap_or_else(|| {
            self.reasons.push(reason);
            self.reasons.len() - 1
        });
        self.reverted.push(reason_index as u8);
        if let Blocker::Agent(other) = reverted.blocker {
            self.others.extend((other as u32).to_le_bytes());
        }
    }

    /// Rule: occupancy/as-released
    fn add_marks(&mut self, trace: &Trace, state: &Snapshot, at: u32) {
        let map = &trace.header.map;
        let mut has_agent = vec![false; map.obstacles().len()];
        let active = state.cells.iter().zip(&state.active).filter(|&(_, &active)| active);
        active.for_each(|(&cell, _)| has_agent[map.index(cell)] = true);
        let mut has_mark = vec![false; map.obstacles().len()];
        let marked = state.occupied.iter().filter(|&&cell| map.contains(cell));
        marked.for_each(|&cell| has_mark[map.index(cell)] = true);
        for index in (0..has_mark.len()).filter(|&index| has_mark[index] != has_agent[index]) {
            self.marks.extend(at.to_le_bytes());
            put_cell(&mut self.marks, map.cell_at(index));
        }
    }
}

fn put_cell(bytes: &mut Vec<u8>, cell: Cell) {
    bytes.extend(cell.row.to_le_bytes());
    bytes.extend(cell.col.to_le_bytes());
}

/// Packs eight flags into a byte, the first flag in the lowest bit.
fn bits(flags: &[bool]) -> Vec<u8> {
    let byte = |flags: &[bool]| flags.iter().rev().fold(0, |byte, &flag| byte << 1 | u8::from(flag));
    flags.chunks(8).map(byte).collect()
}
