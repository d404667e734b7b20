//! What agents see, as policies, meters and records want it.

use std::fmt::Write as _;

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
    let bits: Vec<bool> = window.iter().map(|&value| value != 0.0).collect();
    pack_bits(&bits)
}

/// The same of flags.
pub(crate) fn pack_bits(bits: &[bool]) -> String {
    let byte = |cells: &[bool]| {
        cells.iter().enumerate().fold(0u8, |byte, (at, &bit)| byte | (u8::from(bit) << (7 - at)))
    };
    bits.chunks(8).fold(String::new(), |mut text, cells| {
        let _ = write!(text, "{:02x}", byte(cells));
        text
    })
}

/// What [`pack`] packed, and the zeros that filled the last byte.
pub(crate) fn unpack(window: &str) -> Vec<bool> {
    let digit = |character: char| character.to_digit(16).unwrap_or(0);
    window
        .chars()
        .flat_map(|character| (0..4).rev().map(move |bit| digit(character) >> bit & 1 == 1))
        .collect()
}
