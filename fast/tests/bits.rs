//! Windows cut out of strips hold what plain indexing of the map finds.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pogema_core::{Cell, Config, Environment, GoalStream, Instance, Map, Outside};
use pogema_fast::{Engine, SimdPath, words_per_agent};
use quickcheck::{Arbitrary, Gen, QuickCheck};

/// Miri, which looks at every access to memory, has time for a few small scenes.
const NUM_SCENES: u64 = if cfg!(miri) { 50 } else { 400 };
const MOST_ROWS: usize = if cfg!(miri) { 3 } else { 12 };
const MOST_COLS: usize = if cfg!(miri) { 80 } else { 200 };
const MOST_AGENTS: usize = if cfg!(miri) { 4 } else { 20 };

/// A map, often wide, with some agents on it.
#[derive(Clone, Debug)]
struct WindowSource {
    height: usize,
    width: usize,
    radius: usize,
    obstacles: Vec<bool>,
    starts: Vec<Cell>,
    goals: Vec<Cell>,
    has_noise: bool,
}

fn below(g: &mut Gen, limit: usize) -> usize {
    u32::arbitrary(g) as usize % limit
}

fn any_cell(g: &mut Gen, height: usize, width: usize) -> Cell {
    Cell::new(below(g, height) as u16, below(g, width) as u16)
}

impl Arbitrary for WindowSource {
    fn arbitrary(g: &mut Gen) -> Self {
        let (height, width) = (1 + below(g, MOST_ROWS), 1 + below(g, MOST_COLS));
        let radius = match below(g, 8) {
            _ if cfg!(miri) => 1 + below(g, 6),
            0 => 16 + below(g, 2),
            1 => 1 + below(g, Config::LARGEST_RADIUS),
            _ => 1 + below(g, 20),
        };
        let density = below(g, 101);
        let obstacles = (0..height * width).map(|_| below(g, 100) < density).collect();
        let mut starts: Vec<Cell> = (0..=below(g, MOST_AGENTS)).map(|_| any_cell(g, height, width)).collect();
        starts.sort();
        starts.dedup();
        let goals = starts.iter().map(|_| any_cell(g, height, width)).collect();
        Self { height, width, radius, obstacles, starts, goals, has_noise: bool::arbitrary(g) }
    }

    fn shrink(&self) -> Box<dyn Iterator<Item = Self>> {
        let plain = |scene: &Self| Self { has_noise: false, ..scene.clone() };
        let free = |scene: &Self| Self { obstacles: vec![false; scene.obstacles.len()], ..scene.clone() };
        let narrow = |scene: &Self| Self { radius: scene.radius.max(2) - 1, ..scene.clone() };
        let lonely = |agent: usize| Self {
            starts: vec![self.starts[agent]],
            goals: vec![self.goals[agent]],
            ..self.clone()
        };
        let mut smaller = vec![plain(self), free(self), narrow(self)];
        smaller.extend((0..self.starts.len()).filter(|_| self.starts.len() > 1).map(lonely));
        let is_smaller = |scene: &Self| {
            (scene.has_noise, &scene.obstacles, scene.radius, scene.starts.len())
                != (self.has_noise, &self.obstacles, self.radius, self.starts.len())
        };
        Box::new(smaller.into_iter().filter(is_smaller).collect::<Vec<_>>().into_iter())
    }
}

impl WindowSource {
    fn config(&self) -> Config {
        Config { num_agents: self.starts.len(), radius: self.radius, ..Config::default() }
    }

    /// Whether the noise has an obstacle, counted from the corner of the border.
    fn is_noise(row: usize, col: usize) -> bool {
        (row * 7 + col * 11 + row * col).is_multiple_of(3)
    }

    fn instance(&self) -> Instance {
        let map = Map::new(self.height, self.width, self.obstacles.clone()).unwrap();
        let (height, width) = (self.height + 2 * self.radius, self.width + 2 * self.radius);
        let noise = (0..height * width).map(|index| Self::is_noise(index / width, index % width)).collect();
        let noise = Outside::Noise(Map::new(height, width, noise).unwrap());
        let outside = if self.has_noise { noise } else { Outside::Free };
        let goals = self.goals.iter().map(|&goal| GoalStream::single(goal)).collect();
        Instance::new(map, outside, self.starts.clone(), goals).unwrap()
    }

    /// Whether there is an obstacle at a place counted from the map's corner, on the map, its wall or beyond.
    fn is_obstacle(&self, row: i32, col: i32) -> bool {
        let (height, width, border) = (self.height as i32, self.width as i32, self.radius as i32);
        if (0..height).contains(&row) && (0..width).contains(&col) {
            return self.obstacles[row as usize * self.width + col as usize];
        }
        let is_wall = (-1..=height).contains(&row) && (-1..=width).contains(&col);
        is_wall || self.has_noise && Self::is_noise((row + border) as usize, (col + border) as usize)
    }

    fn has_agent(&self, row: i32, col: i32) -> bool {
        self.starts.iter().any(|start| (i32::from(start.row), i32::from(start.col)) == (row, col))
    }

    /// What an agent sees: obstacles, agents, goal.
    fn window(&self, agent: usize) -> Vec<bool> {
        let radius = self.radius as i32;
        let (start, goal) = (self.starts[agent], self.goals[agent]);
        let (row, col) = (i32::from(start.row), i32::from(start.col));
        let around =
            || (-radius..=radius).flat_map(|down| (-radius..=radius).map(move |right| (down, right)));
        let goal_down = (i32::from(goal.row) - row).clamp(-radius, radius);
        let goal_right = (i32::from(goal.col) - col).clamp(-radius, radius);
        let obstacles = around().map(|(down, right)| self.is_obstacle(row + down, col + right));
        let agents = around().map(|(down, right)| self.has_agent(row + down, col + right));
        obstacles.chain(agents).chain(around().map(|place| place == (goal_down, goal_right))).collect()
    }
}

/// Bits in words, from the lowest bit of the first word on.
fn pack(bits: &[bool]) -> Vec<u64> {
    let word = |bits: &[bool]| bits.iter().rev().fold(0, |word, &bit| word << 1 | u64::from(bit));
    bits.chunks(64).map(word).collect()
}

fn bits_are_what_indexing_finds(scene: WindowSource) -> bool {
    let num_agents = scene.starts.len();
    let want: Vec<u64> = (0..num_agents).flat_map(|agent| pack(&scene.window(agent))).collect();
    SimdPath::ALL.into_iter().filter(|path| path.is_available()).all(|path| {
        let mut engine = Engine::with_path(scene.config(), path).unwrap();
        engine.reset(&scene.instance()).unwrap();
        let mut got = vec![u64::MAX; num_agents * words_per_agent(scene.radius)];
        engine.observe_bits(0..num_agents, &mut got).unwrap();
        want == got
    })
}

#[test]
fn windows_hold_what_indexing_finds() {
    QuickCheck::new().tests(NUM_SCENES).quickcheck(bits_are_what_indexing_finds as fn(WindowSource) -> bool);
}

/// Every column of a map in turn, so that windows of every width meet every border between strips.
#[test]
fn windows_hold_what_indexing_finds_at_every_column() {
    const WIDTH: usize = 200;
    for radius in [1, 2, 5, 6, 15, 16, 17, 31, 32, 33, 48, 64, 96, 128] {
        let obstacles = (0..2 * WIDTH).map(|index| (index * index / 7) % 3 == 0).collect();
        for first in 0..if radius > 33 { 4 } else { 20 } {
            // A few agents at a time, so that the windows of agents differ.
            let cols = (first..WIDTH).step_by(if radius > 33 { 37 } else { 20 });
            let starts: Vec<Cell> = cols.map(|col| Cell::new((col % 2) as u16, col as u16)).collect();
            let goals = starts.iter().map(|start| Cell::new(0, 199 - start.col)).collect();
            let scene = WindowSource {
                height: 2,
                width: WIDTH,
                radius,
                obstacles: Vec::clone(&obstacles),
                starts,
                goals,
                has_noise: radius % 2 == 0,
            };
            assert!(bits_are_what_indexing_finds(scene.clone()), "{scene:?}");
        }
    }
}
