//! Random plans: a config, instances and operations, mostly small and crowded.

use std::sync::Arc;

use pogema_core::{
    Action, Cell, Collision, Config, GoalStream, Instance, Map, Observation, Occupancy, OnGoal, Outside,
    Reward, Snapshot, Words,
};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

/// Largest side length of a map that is not a corridor.
const MAX_SIDE: usize = 14;
/// Largest number of cells of a map.
const MAX_CELLS: usize = MAX_SIDE * MAX_SIDE;
/// Largest number of agents.
const MAX_AGENTS: usize = 30;
/// Largest number of cells in the windows of all agents together, so that wide windows do not dominate the run time.
const MAX_OBSERVED: usize = 70_000;

/// A config, instances, and the operations to play.
#[derive(Clone, Debug)]
pub struct Plan {
    pub config: Config,
    pub instances: Vec<Instance>,
    pub ops: Vec<Op>,
}

/// One operation.
#[derive(Clone, Debug)]
pub enum Op {
    /// The drift, and for each agent a number: 0 to 4 is an action; an agent with a larger number follows the drift.
    Step(Drift, Vec<u8>),
    Back,
    /// Resets to one of the instances.
    Reset(usize),
}

/// The direction of agents without an action of their own.
#[derive(Clone, Copy, Debug)]
pub enum Drift {
    /// All agents in the same direction, which makes queues.
    Along(Action),
    /// Around each 2 x 2 block, which makes rings.
    Round,
    /// Towards the neighbour in the other column of a pair, which makes swaps.
    Across,
    /// One step towards the goal.
    ToGoal,
}

impl Drift {
    fn action(self, cell: Cell, goal: Cell) -> Action {
        match self {
            Self::Along(action) => action,
            Self::Round => match (cell.row % 2, cell.col % 2) {
                (0, 0) => Action::Right,
                (0, _) => Action::Down,
                (_, 0) => Action::Up,
                _ => Action::Left,
            },
            Self::Across if cell.col.is_multiple_of(2) => Action::Right,
            Self::Across => Action::Left,
            Self::ToGoal if goal.row < cell.row => Action::Up,
            Self::ToGoal if goal.row > cell.row => Action::Down,
            Self::ToGoal if goal.col < cell.col => Action::Left,
            Self::ToGoal if goal.col > cell.col => Action::Right,
            Self::ToGoal => Action::Stay,
        }
    }

    /// Returns the actions of all agents in a state.
    pub fn actions(self, choices: &[u8], state: &Snapshot) -> Vec<Action> {
        let places = state.cells.iter().zip(&state.goals);
        let choose = |(&choice, (&cell, &goal)): (&u8, (&Cell, &Cell))| {
            Action::ALL.get(usize::from(choice)).copied().unwrap_or_else(|| self.action(cell, goal))
        };
        choices.iter().zip(places).map(choose).collect()
    }
}

/// The numbers that define an instance; each of them shrinks independently.
#[derive(Clone, Debug)]
struct Ground {
    height: usize,
    width: usize,
    /// Obstacles per 100 cells.
    density: u8,
    /// One number per cell; the cell is an obstacle if its number is below the density.
    levels: Vec<u8>,
    /// The agents start on the cells with the lowest numbers; free cells come first unless `starts_on_obstacles`.
    order: Vec<u16>,
    starts_on_obstacles: bool,
    goals: Vec<Vec<u16>>,
    noise: Option<u64>,
}

impl Ground {
    fn cell(&self, pick: u16) -> Cell {
        let index = usize::from(pick) % (self.height * self.width);
        Cell::new((index / self.width) as u16, (index % self.width) as u16)
    }

    fn stream(&self, picks: &[u16]) -> GoalStream {
        let cells: Vec<Cell> = picks.iter().map(|&pick| self.cell(pick)).collect();
        if cells.len() == 1 {
            return GoalStream::single(cells[0]);
        }
        GoalStream::sequence(cells[0], Arc::from(cells))
    }

    fn instance(&self, num_agents: usize, radius: usize) -> Instance {
        let num_cells = self.height * self.width;
        let obstacles: Vec<bool> = self.levels[..num_cells].iter().map(|&own| own < self.density).collect();
        let mut indices: Vec<usize> = (0..num_cells).collect();
        indices.sort_by_key(|&index| (obstacles[index] && !self.starts_on_obstacles, self.order[index]));
        let map = Map::new(self.height, self.width, obstacles).unwrap();
        let starts = indices[..num_agents].iter().map(|&index| map.cell_at(index)).collect();
        let goals = self.goals[..num_agents].iter().map(|picks| self.stream(picks)).collect();
        let outside = self.noise.map_or(Outside::Free, |seed| {
            let (height, width) = (self.height + 2 * radius, self.width + 2 * radius);
            let is_obstacle = |index: usize| mix(seed, index).is_multiple_of(3);
            Outside::Noise(Map::new(height, width, (0..height * width).map(is_obstacle).collect()).unwrap())
        });
        Instance::new(map, outside, starts, goals).unwrap()
    }
}

/// Returns a pseudo-random number.
fn mix(seed: u64, index: usize) -> u64 {
    let mixed = (seed ^ index as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (mixed ^ mixed >> 31).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 33
}

fn grounds() -> impl Strategy<Value = Ground> {
    let side = || prop_oneof![6 => 1..=5usize, 3 => 1..=MAX_SIDE];
    let across = || 1..=2usize;
    let along = || 1..=MAX_CELLS / 2;
    let extent = prop_oneof![8 => (side(), side()), 1 => (across(), along()), 1 => (along(), across())];
    let density = prop_oneof![3 => Just(0u8), 3 => 1..=25u8, 1 => 25..=80u8, 1 => Just(100u8)];
    let noise = prop_oneof![3 => Just(None), 1 => any::<u64>().prop_map(Some)];
    let goals = vec(vec(any::<u16>(), 1..=3), MAX_AGENTS);
    let numbers = (vec(0..100u8, MAX_CELLS), vec(any::<u16>(), MAX_CELLS), proptest::bool::weighted(0.08));
    (extent, density, numbers, goals, noise).prop_map(
        |((height, width), density, (levels, order, starts_on_obstacles), goals, noise)| Ground {
            height,
            width,
            density,
            levels,
            order,
            starts_on_obstacles,
            goals,
            noise,
        },
    )
}

fn configs() -> impl Strategy<Value = Config> {
    let radius = prop_oneof![
        20 => 1..=4usize,
        10 => select(vec![5usize, 6, 7, 8, 15, 16, 17]),
        1 => select(vec![31usize, 32, 33, 64, 128]),
        1 => 1..=Config::LARGEST_RADIUS,
    ];
    let collision = select(vec![Collision::Priority, Collision::BlockBoth, Collision::Soft, Collision::Soft]);
    let on_goal = select(OnGoal::all().collect::<Vec<_>>());
    let occupancy = select(vec![Occupancy::AsReleased, Occupancy::Exact]);
    let reward = select(vec![Reward::Own, Reward::Shared]);
    let max_steps = select(vec![-1i64, 0, 1, 2, 3, 7, 64]);
    let rules = (collision, on_goal, occupancy, reward);
    (radius, rules, max_steps, proptest::bool::weighted(0.3)).prop_map(
        |(radius, (collision, on_goal, occupancy, reward), max_steps, persistent)| Config {
            num_agents: 1,
            radius,
            max_steps,
            collision,
            on_goal,
            observation: Observation::Default,
            occupancy,
            reward,
            persistent,
        },
    )
}

fn ops() -> impl Strategy<Value = Vec<Op>> {
    let drift = prop_oneof![
        2 => select(Action::ALL[1..].to_vec()).prop_map(Drift::Along),
        4 => Just(Drift::Round),
        1 => Just(Drift::Across),
        2 => Just(Drift::ToGoal),
    ];
    // The larger the range, the more agents drift; with the range 5, none does.
    let choice = |max: u8| vec(0..max, MAX_AGENTS);
    let choices = prop_oneof![1 => choice(5), 2 => choice(10), 3 => choice(60)];
    let op = prop_oneof![
        16 => (drift, choices).prop_map(|(drift, choices)| Op::Step(drift, choices)),
        2 => Just(Op::Back),
        1 => (0..2usize).prop_map(Op::Reset),
    ];
    vec(op, 0..=14)
}

/// Returns a strategy for plans that vary every input of the engines.
pub fn plans() -> impl Strategy<Value = Plan> {
    // `quarters` sets the size of the crowd: the share of cells with an agent, in quarters. 0 means `few` agents.
    (configs(), vec(grounds(), 2), any::<bool>(), 0..=4usize, 0..MAX_AGENTS, ops()).prop_map(
        |(config, mut grounds, same_size, quarters, few, mut ops)| {
            if same_size {
                (grounds[1].height, grounds[1].width) = (grounds[0].height, grounds[0].width);
            }
            let num_cells = grounds.iter().map(|ground| ground.height * ground.width).min().unwrap_or(1);
            let requested = if quarters == 0 { few % num_cells } else { num_cells * quarters / 4 };
            let max_agents = (MAX_OBSERVED / (config.side() * config.side())).min(MAX_AGENTS).min(num_cells);
            let num_agents = requested.clamp(1, max_agents.max(1));
            let config = Config { num_agents, ..config };
            let instances = grounds.iter().map(|ground| ground.instance(num_agents, config.radius)).collect();
            for op in &mut ops {
                if let Op::Step(_, choices) = op {
                    choices.truncate(num_agents);
                }
            }
            Plan { config, instances, ops }
        },
    )
}
