//! Comparison of the windows extracted from strips with plain indexing of the map.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pogema_core::{Cell, Config, Environment, GoalStream, Instance, Map, Outside};
use pogema_fast::{Engine, SimdPath, words_per_agent};
use quickcheck::{Arbitrary, Gen, QuickCheck};

/// Miri checks every memory access, so it only has time for a few small instances.
const NUM_INSTANCES: u64 = if cfg!(miri) { 50 } else { 400 };
const MAX_ROWS: usize = if cfg!(miri) { 3 } else { 12 };
const MAX_COLS: usize = if cfg!(miri) { 80 } else { 200 };
const MAX_AGENTS: usize = if cfg!(miri) { 4 } else { 20 };

/// A random map, often wide, with some agents on it.
#[derive(Clone, Debug)]
struct RandomInstance {
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

impl Arbitrary for RandomInstance {
    fn arbitrary(g: &mut Gen) -> Self {
        let (height, width) = (1 + below(g, MAX_ROWS), 1 + below(g, MAX_COLS));
        let radius = match below(g, 8) {
            _ if cfg!(miri) => 1 + below(g, 6),
            0 => 16 + below(g, 2),
            1 => 1 + below(g, Config::LARGEST_RADIUS),
            _ => 1 + below(g, 20),
        };
        let density = below(g, 101);
        let obstacles = (0..height * width).map(|_| below(g, 100) < density).collect();
        let mut starts: Vec<Cell> = (0..=below(g, MAX_AGENTS)).map(|_| any_cell(g, height, width)).collect();
        starts.sort();
        starts.dedup();
        let goals = starts.iter().map(|_| any_cell(g, height, width)).collect();
        Self { height, width, radius, obstacles, starts, goals, has_noise: bool::arbitrary(g) }
    }

    fn shrink(&self) -> Box<dyn Iterator<Item = Self>> {
        let plain = |sample: &Self| Self { has_noise: false, ..sample.clone() };
        let free = |sample: &Self| Self { obstacles: vec![false; sample.obstacles.len()], ..sample.clone() };
        let narrow = |sample: &Self| Self { radius: sample.radius.max(2) - 1, ..sample.clone() };
        let single = |agent: usize| Self {
            starts: vec![self.starts[agent]],
            goals: vec![self.goals[agent]],
            ..self.clone()
        };
        let mut smaller = vec![plain(self), free(self), narrow(self)];
        smaller.extend((0..self.starts.len()).filter(|_| self.starts.len() > 1).map(single));
        let is_smaller = |sample: &Self| {
            (sample.has_noise, &sample.obstacles, sample.radius, sample.starts.len())
                != (self.has_noise, &self.obstacles, self.radius, self.starts.len())
        };
        Box::new(smaller.into_iter().filter(is_smaller).collect::<Vec<_>>().into_iter())
    }
}

impl RandomInstance {
    fn config(&self) -> Config {
        Config { num_agents: self.starts.len(), radius: self.radius, ..Config::default() }
    }

    /// Returns whether the noise has an obstacle at a cell. Coordinates are relative to the corner of the border.
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

    /// Returns whether a cell on the map, in the wall or outside is an obstacle. Coordinates are relative to the map's
    /// corner.
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

    /// Returns the observation of an agent: obstacles, agents, goal.
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

/// Packs bits into words, from the lowest bit of the first word on.
fn pack(bits: &[bool]) -> Vec<u64> {
    let word = |bits: &[bool]| bits.iter().rev().fold(0, |word, &bit| word << 1 | u64::from(bit));
    bits.chunks(64).map(word).collect()
}

fn bits_match_indexing(sample: RandomInstance) -> bool {
    let num_agents = sample.starts.len();
    let expected: Vec<u64> = (0..num_agents).flat_map(|agent| pack(&sample.window(agent))).collect();
    SimdPath::available().all(|path| {
        let mut engine = Engine::with_path(sample.config(), path).unwrap();
        engine.reset(&sample.instance()).unwrap();
        let mut got = vec![u64::MAX; num_agents * words_per_agent(sample.radius)];
        engine.observe_bits(0..num_agents, &mut got).unwrap();
        expected == got
    })
}

#[test]
fn windows_hold_what_indexing_finds() {
    QuickCheck::new().tests(NUM_INSTANCES).quickcheck(bits_match_indexing as fn(RandomInstance) -> bool);
}

/// Tests windows of many widths that cross every boundary between strips: at every column of the map for radii up to
/// 33, at some columns for larger radii.
#[test]
fn windows_hold_what_indexing_finds_at_every_column() {
    const WIDTH: usize = 200;
    for radius in [1, 2, 5, 6, 15, 16, 17, 31, 32, 33, 48, 64, 96, 128] {
        let obstacles = (0..2 * WIDTH).map(|index| (index * index / 7) % 3 == 0).collect();
        for first in 0..if radius > 33 { 4 } else { 20 } {
            // Few agents at a time, so that the windows of the agents differ.
            let cols = (first..WIDTH).step_by(if radius > 33 { 37 } else { 20 });
            let starts: Vec<Cell> = cols.map(|col| Cell::new((col % 2) as u16, col as u16)).collect();
            let goals = starts.iter().map(|start| Cell::new(0, 199 - start.col)).collect();
            let sample = RandomInstance {
                height: 2,
                width: WIDTH,
                radius,
                obstacles: Vec::clone(&obstacles),
                starts,
                goals,
                has_noise: radius % 2 == 0,
            };
            assert!(bits_match_indexing(sample.clone()), "{sample:?}");
        }
    }
}
