//! Text frames for the terminal.

mod viewport;

use console::{Style as Paint, truncate_str};
use pogema_core::picture::{CellContent, agent_letter};
use pogema_core::{Cell, Error, Snapshot};

use crate::check::check_agent;
use crate::ground::{Border, Ground};
use viewport::Viewport;

/// Maximum number of agents that are drawn as letters; if there are more, all are numbers.
const MAX_LETTERS: usize = 26;

/// The appearance of a text frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Style {
    /// Draw only the cells that this agent sees, and its own goal.
    pub view: Option<usize>,
    /// The part of the border that is drawn; the thin border is a frame of lines.
    pub border: Border,
    /// Whether colours are used.
    pub is_colored: bool,
    /// Maximum number of rows and columns of characters. A larger map is cropped around the viewing agent, or around
    /// the first active agent. If no agent is active, it is cropped around the first row and column.
    pub max_size: Option<(usize, usize)>,
}

impl Default for Style {
    fn default() -> Self {
        Self { view: None, border: Border::Thin, is_colored: false, max_size: None }
    }
}

/// Draws a state as lines of text. The first line gives the step and, if the map is cropped, the drawn rows and
/// columns.
///
/// Agents are lower-case letters, and their goals are the same letters in upper case. With more than 26 agents, agents
/// are numbers, and their goals are the same numbers after a `*`.
///
/// # Errors
/// [`Error::OutOfRange`] if the viewing agent does not exist or `max_size` has a 0; [`Error::Length`] if the state's
/// lists differ in length.
pub fn frame(ground: Ground<'_>, step: usize, state: &Snapshot, style: &Style) -> Result<String, Error> {
    let num_agents = state.cells.len();
    Error::check_length("goals", num_agents, state.goals.len())?;
    Error::check_length("active", num_agents, state.active.len())?;
    if let Some(agent) = style.view {
        check_agent(agent, num_agents)?;
    }
    if style.max_size.is_some_and(|(rows, cols)| rows == 0 || cols == 0) {
        return Err(Error::out_of_range("size of the terminal", "0", "at least one row and one column"));
    }
    let cell_width = if num_agents > MAX_LETTERS { (num_agents - 1).to_string().len() + 1 } else { 1 };
    let viewport = Viewport::of(ground, state, style, cell_width);
    let drawing = Drawing { ground, step, state, style, cell_width, viewport };
    let (most_rows, longest) = style.max_size.unwrap_or((usize::MAX, usize::MAX));
    let lines = drawing.lines();
    Ok(lines
        .iter()
        .take(most_rows)
        .map(|line| truncate_str(line, longest, ""))
        .collect::<Vec<_>>()
        .join("\n"))
}

struct Drawing<'a> {
    ground: Ground<'a>,
    step: usize,
    state: &'a Snapshot,
    style: &'a Style,
    cell_width: usize,
    viewport: Viewport,
}

impl Drawing<'_> {
    fn lines(&self) -> Vec<String> {
        let viewport = &self.viewport;
        let edge = "─".repeat(viewport.cols.len() * (self.cell_width + 1) + 1);
        let is_framed = self.style.border == Border::Thin;
        let mut lines = vec![format!("step {}{}", self.step, viewport.crop())];
        if is_framed {
            lines.push(format!("┌{edge}┐"));
        }
        let contents = self.contents();
        for row in contents.chunks(viewport.cols.len()) {
            let cells = row.iter().map(|&content| self.paint(content)).collect::<Vec<_>>().join(" ");
            lines.push(if is_framed { format!("│ {cells} │") } else { cells });
        }
        if is_framed {
            lines.push(format!("└{edge}┘"));
        }
        lines
    }

    /// Returns the content of each cell of the viewport, row by row; `None` for an unseen cell. An agent hides a goal,
    /// and a lower index hides a higher one.
    fn contents(&self) -> Vec<Option<CellContent>> {
        let Viewport { rows, cols, .. } = &self.viewport;
        let ground = |row, col| {
            let content =
                if self.ground.is_obstacle(row, col) { CellContent::Obstacle } else { CellContent::Free };
            self.is_seen(row, col).then_some(content)
        };
        let mut contents: Vec<_> =
            rows.clone().flat_map(|row| cols.clone().map(move |col| ground(row, col))).collect();
        let mut put = |agent: usize, cell: Cell, content: CellContent| {
            let (row, col) = (i32::from(cell.row), i32::from(cell.col));
            if self.state.active[agent] && rows.contains(&row) && cols.contains(&col) {
                contents[(row - rows.start) as usize * cols.len() + (col - cols.start) as usize] =
                    Some(content);
            }
        };
        for agent in (0..self.state.cells.len()).rev() {
            // An agent knows the cell of its own goal even if it does not see the cell.
            if self.style.view.is_none_or(|own| own == agent) {
                put(agent, self.state.goals[agent], CellContent::Goal(agent));
            }
        }
        for agent in (0..self.state.cells.len()).rev() {
            let cell = self.state.cells[agent];
            if self.is_seen(cell.row.into(), cell.col.into()) {
                put(agent, cell, CellContent::Agent(agent));
            }
        }
        contents
    }

    fn is_seen(&self, row: i32, col: i32) -> bool {
        self.style.view.is_none_or(|own| self.ground.sees(self.state.cells[own], row, col))
    }

    fn paint(&self, content: Option<CellContent>) -> String {
        let width = self.cell_width;
        let plain = Paint::new().force_styling(self.style.is_colored);
        match content {
            None => " ".repeat(width),
            Some(CellContent::Free) => plain.dim().apply_to(format!("{:>width$}", '·')).to_string(),
            Some(CellContent::Obstacle) => "█".repeat(width),
            Some(CellContent::Agent(agent)) => {
                colored(plain, agent).bold().apply_to(format!("{:>width$}", self.name(agent))).to_string()
            }
            Some(CellContent::Goal(agent)) => {
                let name = if width == 1 {
                    self.name(agent).to_ascii_uppercase()
                } else {
                    format!("*{}", self.name(agent))
                };
                colored(plain, agent).dim().apply_to(format!("{name:>width$}")).to_string()
            }
        }
    }

    fn name(&self, agent: usize) -> String {
        if self.cell_width == 1 { agent_letter(agent).to_string() } else { agent.to_string() }
    }
}

/// Styles an agent in one of six colours that are distinct on black and on white.
fn colored(paint: Paint, agent: usize) -> Paint {
    const COLORS: [u8; 6] = [196, 33, 40, 208, 129, 220];
    paint.color256(COLORS[agent % COLORS.len()])
}
