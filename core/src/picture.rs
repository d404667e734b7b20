//! Text pictures of a state, for cases, reports and the terminal.

use crate::{Cell, Map, Snapshot};

/// Returns the letter of an agent: `a` to `z`, then digits, then `?`.
pub fn agent_letter(agent: usize) -> char {
    const LETTERS: &[u8] = b"abcdefghijklmnopqrstuvwxyz0123456789";
    LETTERS.get(agent).map_or('?', |&letter| letter as char)
}

/// The content of one cell of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CellContent {
    /// No obstacle, agent or goal.
    Free,
    /// An obstacle.
    Obstacle,
    /// An active agent, given by its index.
    Agent(usize),
    /// The goal of an active agent, given by the agent's index.
    Goal(usize),
}

/// Returns the content of each cell of the map, row by row.
///
/// An agent hides a goal, and a lower index hides a higher one.
pub fn contents(map: &Map, snapshot: &Snapshot) -> Vec<CellContent> {
    let ground = |&obstacle: &bool| if obstacle { CellContent::Obstacle } else { CellContent::Free };
    let mut contents: Vec<CellContent> = map.obstacles().iter().map(ground).collect();
    let mut put = |cells: &[Cell], content: fn(usize) -> CellContent| {
        for (agent, &cell) in cells.iter().enumerate().rev() {
            if snapshot.active[agent] && map.contains(cell) {
                contents[map.index(cell)] = content(agent);
            }
        }
    };
    put(&snapshot.goals, CellContent::Goal);
    put(&snapshot.cells, CellContent::Agent);
    contents
}

/// Draws the agents: `.` is free, `#` an obstacle, `a` agent 0, `A` its goal, and so on. From agent 26 on, a goal has
/// the same character as its agent.
pub fn picture(map: &Map, snapshot: &Snapshot) -> String {
    let letter = |content: &CellContent| match *content {
        CellContent::Free => '.',
        CellContent::Obstacle => '#',
        CellContent::Agent(agent) => agent_letter(agent),
        CellContent::Goal(agent) => agent_letter(agent).to_ascii_uppercase(),
    };
    lines(map, contents(map, snapshot).iter().map(letter))
}

/// Draws the occupancy grid, with `o` for each marked cell.
pub fn occupancy_picture(map: &Map, snapshot: &Snapshot) -> String {
    let mut letters: Vec<char> = map.rows().concat().chars().collect();
    for &cell in &snapshot.occupied {
        if map.contains(cell) {
            letters[map.index(cell)] = 'o';
        }
    }
    lines(map, letters.into_iter())
}

fn lines(map: &Map, letters: impl Iterator<Item = char>) -> String {
    let letters: Vec<char> = letters.collect();
    letters.chunks(map.width()).map(|row| row.iter().collect::<String>()).collect::<Vec<_>>().join("\n")
}
