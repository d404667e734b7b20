//! The visible parts of an episode at each frame, for every output format.

use std::ops::Range;

use pogema_core::{Cell, Config, Error, OnGoal, Snapshot, Trace};

use crate::check::{check, check_agent};
use crate::ground::Ground;
use crate::style::{Color, Style};

/// Opacity of agents and obstacles that the viewing agent does not see.
pub const SHADED: f64 = 0.2;

/// Opacity of lines, so that agents and goals stand out. POGEMA's lines are opaque.
pub const LINE_OPACITY: f64 = 0.4;

/// Sizes in POGEMA's pictures. Units: cells.
///
/// Source: POGEMA 1.4.0, `svg_animation/animation_drawer.py`, `SvgSettings`
pub mod size {
    /// Radius of agents and goals.
    pub const AGENT: f64 = 0.35;
    /// Width of lines and of goals' rings.
    pub const STROKE: f64 = 0.1;
    /// Side of an obstacle.
    pub const OBSTACLE: f64 = 0.7;
    /// Radius of an obstacle's corners and of the window's.
    pub const CORNER: f64 = 0.15;
    /// Length of the dashes around the window, and of the gaps between them.
    pub const DASH: f64 = 0.25;
    /// Distance of the window's frame from the centres of the outermost cells in the window.
    pub const WINDOW: f64 = 0.45;
    /// Distance of the picture's edge from the centres of the outermost cells.
    pub const MARGIN: f64 = 1.0;
}

/// An agent or a goal at one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    pub cell: Cell,
    pub is_visible: bool,
    pub opacity: f64,
}

/// Obstacles that the viewing agent first sees at the same frame.
pub struct Obstacles {
    /// The frame at which the viewing agent first sees them; none for never.
    pub seen: Option<usize>,
    /// The obstacles as (row, col), row by row.
    pub cells: Vec<(i32, i32)>,
}

/// An episode with a style that was checked to fit it.
pub struct Scene<'a> {
    pub trace: &'a Trace,
    pub style: &'a Style,
    /// The states that are drawn.
    pub states: Vec<&'a Snapshot>,
    /// The states up to and including the first drawn state, which determine what the viewing agent has seen by then.
    before: Vec<&'a Snapshot>,
}

impl<'a> Scene<'a> {
    /// Returns the number of agents of the episode.
    pub fn num_agents(&self) -> usize {
        self.states.first().map_or(0, |state| state.cells.len())
    }

    /// Returns the scene of an episode.
    ///
    /// # Errors
    /// Those of [`check`], and if the style names a missing agent or frame or is otherwise invalid.
    pub fn new(trace: &'a Trace, style: &'a Style) -> Result<Self, Error> {
        check(trace)?;
        if style.colors.agents.is_empty() {
            return Err(Error::out_of_range("number of agents' colours", 0, "at least 1"));
        }
        if !(style.step_time > 0.0 && style.step_time.is_finite()) {
            let expected = "a finite number of seconds greater than 0";
            return Err(Error::out_of_range("time of a step", style.step_time, expected));
        }
        let mut states: Vec<&Snapshot> = trace.states().collect();
        if let Some(agent) = style.egocentric {
            check_agent(agent, trace.start.state.cells.len())?;
            states.truncate(num_frames_of(&trace.header.config, agent, &states));
        }
        let Some(frame) = style.static_frame else {
            let before = states[..1].to_vec();
            return Ok(Self { trace, style, states, before });
        };
        let state = trace.state(frame)?;
        let before = trace.states().take(frame + 1).collect();
        Ok(Self { trace, style, states: vec![state], before })
    }

    /// Returns the ground and its drawn rows and columns.
    fn ground(&self) -> (Ground<'a>, Range<i32>, Range<i32>) {
        let ground = Ground::of(self.trace);
        (ground, ground.rows(self.style.border), ground.cols(self.style.border))
    }

    /// Returns the left edge, upper edge, width and height of the picture. Units: cells, from the centre of (0, 0).
    pub fn view_box(&self) -> [i32; 4] {
        let (_, rows, cols) = self.ground();
        let margin = size::MARGIN as i32;
        [
            cols.start - margin,
            rows.start - margin,
            cols.end - cols.start + 2 * margin - 1,
            rows.end - rows.start + 2 * margin - 1,
        ]
    }

    /// Returns all obstacles, grouped by the frame at which they are first seen; those never seen come last. Without a
    /// viewing agent all are seen at frame 0.
    pub fn obstacles(&self) -> Vec<Obstacles> {
        let (ground, rows, cols) = self.ground();
        let num_cols = cols.len();
        let first_seen = self.first_seen();
        let mut groups = vec![Vec::new(); self.states.len() + 1];
        for (at_row, row) in rows.enumerate() {
            for (at_col, col) in cols.clone().enumerate() {
                if ground.is_obstacle(row, col) {
                    let seen = first_seen.as_ref().map_or(0, |first| first[at_row * num_cols + at_col]);
                    groups[seen.min(self.states.len())].push((row, col));
                }
            }
        }
        let frame = |at: usize| (at < self.states.len()).then_some(at);
        let groups = groups.into_iter().enumerate().map(|(at, cells)| Obstacles { seen: frame(at), cells });
        groups.filter(|group| !group.cells.is_empty()).collect()
    }

    /// Returns the frame at which the viewing agent first sees each cell, row by row; `usize::MAX` for never.
    fn first_seen(&self) -> Option<Vec<usize>> {
        let agent = self.style.egocentric?;
        let (ground, rows, cols) = self.ground();
        let mut first = vec![usize::MAX; rows.len() * cols.len()];
        let past = self.before.iter().map(|state| (0, state));
        let mut last = None;
        for (frame, state) in past.chain(self.states.iter().enumerate()) {
            let cell = state.cells[agent];
            if last.replace(cell) == Some(cell) {
                continue;
            }
            let radius = ground.radius as i32;
            let around = |at: u16, range: &Range<i32>| {
                (i32::from(at) - radius).max(range.start)..(i32::from(at) + radius + 1).min(range.end)
            };
            for row in around(cell.row, &rows) {
                for col in around(cell.col, &cols) {
                    let at = (row - rows.start) as usize * cols.len() + (col - cols.start) as usize;
                    first[at] = first[at].min(frame);
                }
            }
        }
        Some(first)
    }

    /// Returns the agents that are drawn: those active in any of the frames, or none if the style hides agents.
    pub fn agents(&self) -> Vec<usize> {
        if !self.style.show_agents {
            return Vec::new();
        }
        let is_active = |&agent: &usize| self.states.iter().any(|state| state.active[agent]);
        (0..self.trace.start.state.cells.len()).filter(is_active).collect()
    }

    /// Returns the agents whose goals are drawn. In the view of an agent, this is only the viewing agent.
    pub fn goals(&self) -> Vec<usize> {
        let is_drawn = |agent: &usize| self.style.egocentric.is_none_or(|own| own == *agent);
        self.agents().into_iter().filter(is_drawn).collect()
    }

    /// Returns the look of an agent at a frame.
    pub fn agent(&self, agent: usize, frame: usize) -> Look {
        let state = self.states[frame];
        let (cell, ground) = (state.cells[agent], Ground::of(self.trace));
        let is_seen = |own: usize| ground.sees(state.cells[own], cell.row.into(), cell.col.into());
        let opacity = if self.style.egocentric.is_none_or(is_seen) { 1.0 } else { SHADED };
        Look { cell, is_visible: state.active[agent], opacity }
    }

    /// Returns the look of an agent's goal at a frame.
    pub fn goal(&self, agent: usize, frame: usize) -> Look {
        let state = self.states[frame];
        Look { cell: state.goals[agent], is_visible: state.active[agent], opacity: 1.0 }
    }

    /// Returns the agent whose window is drawn.
    pub fn window(&self) -> Option<usize> {
        self.style.egocentric.filter(|_| self.style.show_agents)
    }

    /// Returns the colour of an agent and its goal.
    pub fn color(&self, agent: usize) -> Color {
        let colors = &self.style.colors;
        match self.style.egocentric {
            Some(own) if own == agent => colors.own,
            Some(_) => colors.others,
            None => colors.agents[agent % colors.agents.len()],
        }
    }
}

/// Returns the number of frames of an agent's view, which ends when the agent finishes.
fn num_frames_of(config: &Config, agent: usize, states: &[&Snapshot]) -> usize {
    let end = states.iter().position(|state| !state.active[agent]);
    match end {
        Some(end) if config.on_goal == OnGoal::Finish => end + 1,
        _ => states.len(),
    }
}
