//! What agents see, as policies, meters and records want it.

use pogema_core::{Environment, Error, PomapfOut};
use pogema_planners::View;

/// The arrays of the `POMAPF` observation.
#[derive(Clone, Debug)]
pub struct Windows {
    side: usize,
    pub(crate) obstacles: Vec<f32>,
    pub(crate) agents: Vec<f32>,
    pub(crate) cells: Vec<i32>,
    pub(crate) goals: Vec<i32>,
}

impl Windows {
    /// Looks through the eyes of all agents.
    ///
    /// # Errors
    /// Before the first reset.
    pub fn of(environment: &dyn Environment) -> Result<Self, Error> {
        let config = environment.config();
        let (num_agents, side) = (config.num_agents, config.side());
        let mut windows = Self {
            side,
            obstacles: vec![0.0; num_agents * side * side],
            agents: vec![0.0; num_agents * side * side],
            cells: vec![0; 2 * num_agents],
            goals: vec![0; 2 * num_agents],
        };
        environment.observe_pomapf(PomapfOut {
            obstacles: &mut windows.obstacles,
            agents: &mut windows.agents,
            cells: &mut windows.cells,
            goals: &mut windows.goals,
        })?;
        Ok(windows)
    }

    /// What each agent's A* is told.
    pub fn views(&self) -> impl Iterator<Item = View<'_>> {
        let obstacles = self.obstacles.chunks(self.side * self.side);
        let places = pairs(&self.cells).into_iter().zip(pairs(&self.goals));
        obstacles.zip(places).map(|(obstacles, (cell, goal))| View { cell, goal, obstacles, side: self.side })
    }

    /// For each agent how many agents and how many free cells it sees.
    pub fn counts(&self) -> Vec<(u32, u32)> {
        let area = self.side * self.side;
        let count =
            |window: &[f32], wanted: bool| window.iter().filter(|&&value| (value != 0.0) == wanted).count();
        let agents = self.agents.chunks(area).map(|window| count(window, true) as u32);
        let free = self.obstacles.chunks(area).map(|window| count(window, false) as u32);
        agents.zip(free).collect()
    }
}

/// Values two by two.
pub(crate) fn pairs(values: &[i32]) -> Vec<[i32; 2]> {
    values.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect()
}

/// Eight cells to a byte, the first one in its highest bit, as hexadecimal digits.
pub(crate) fn pack(window: &[f32]) -> String {
    in_digits(window, |&value| value != 0.0)
}

/// The same of flags.
pub(crate) fn pack_bits(bits: &[bool]) -> String {
    in_digits(bits, |&bit| bit)
}

fn in_digits<T>(cells: &[T], is_set: impl Fn(&T) -> bool) -> String {
    const DIGITS: [char; 16] =
        ['0', '1', '2', '3', '4', '5', '6', '7', '8', '9', 'a', 'b', 'c', 'd', 'e', 'f'];
    let mut text = String::with_capacity(2 * cells.len().div_ceil(8));
    for cells in cells.chunks(8) {
        let bit = |byte: u8, (at, cell)| byte | u8::from(is_set(cell)) << (7 - at);
        let byte = cells.iter().enumerate().fold(0u8, bit);
        text.push(DIGITS[usize::from(byte >> 4)]);
        text.push(DIGITS[usize::from(byte & 15)]);
    }
    text
}

/// What [`pack`] packed, and the zeros that filled the last byte.
pub(crate) fn unpack(window: &str) -> Vec<bool> {
    let digit = |character: char| character.to_digit(16).unwrap_or(0);
    window
        .chars()
        .flat_map(|character| (0..4).rev().map(move |bit| digit(character) >> bit & 1 == 1))
        .collect()
}
