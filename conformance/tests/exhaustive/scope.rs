//! The contents of a scope: maps, placements, joint actions and rules.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering::Relaxed};

use pogema_core::{Action, Cell, Collision, Environment, Map, Occupancy, Snapshot};

/// All maps of a size with a number of agents on them.
#[derive(Clone, Copy, Debug)]
pub struct Scope {
    pub height: usize,
    pub width: usize,
    pub num_agents: usize,
}

impl Scope {
    pub const fn new(height: usize, width: usize, num_agents: usize) -> Self {
        Self { height, width, num_agents }
    }

    pub const fn num_cells(self) -> usize {
        self.height * self.width
    }

    /// Returns the number of maps: one for each set of obstacles.
    pub const fn num_maps(self) -> usize {
        1 << self.num_cells()
    }

    pub fn map(self, index: usize) -> Map {
        let obstacles = (0..self.num_cells()).map(|cell| index >> cell & 1 == 1).collect();
        Map::new(self.height, self.width, obstacles).unwrap()
    }

    /// Returns the number of placements of the agents on different free cells, over all maps. The cells of a placement
    /// are free; each other cell is free or an obstacle.
    pub fn num_placements(self) -> u64 {
        let (cells, agents) = (self.num_cells() as u64, self.num_agents as u64);
        if agents > cells {
            return 0;
        }
        (0..agents).map(|agent| cells - agent).product::<u64>() << (cells - agents)
    }

    /// Returns the number of joint actions.
    pub fn num_actions(self) -> usize {
        5usize.pow(self.num_agents as u32)
    }
}

/// Returns all cells of a map.
pub fn cells_of(map: &Map) -> Vec<Cell> {
    (0..map.obstacles().len()).map(|index| map.cell_at(index)).collect()
}

/// Returns all placements of agents on different free cells.
pub fn placements(map: &Map, num_agents: usize) -> Vec<Vec<Cell>> {
    let free: Vec<Cell> = cells_of(map).into_iter().filter(|&cell| !map.is_obstacle(cell)).collect();
    let is_allowed =
        |starts: &Vec<Cell>| starts.iter().enumerate().all(|(agent, start)| !starts[..agent].contains(start));
    tuples(&free, num_agents).into_iter().filter(is_allowed).collect()
}

/// Returns all tuples of `length` entries of a list.
pub fn tuples(list: &[Cell], length: usize) -> Vec<Vec<Cell>> {
    let mut tuples = vec![Vec::new()];
    for _ in 0..length {
        let longer = |tuple: &Vec<Cell>| {
            let tuple = tuple.clone();
            list.iter().map(move |&last| [tuple.as_slice(), &[last]].concat())
        };
        tuples = tuples.iter().flat_map(longer).collect();
    }
    tuples
}

/// Writes the joint action with the given number, whose base-5 digits are the actions of the agents.
pub fn write_actions(number: usize, actions: &mut [Action]) {
    let mut rest = number;
    for action in actions {
        *action = Action::ALL[rest % 5];
        rest /= 5;
    }
}

/// The collision systems with both kinds of occupancy.
pub const RULES: [(Collision, Occupancy); 6] = [
    (Collision::Priority, Occupancy::AsReleased),
    (Collision::Priority, Occupancy::Exact),
    (Collision::BlockBoth, Occupancy::AsReleased),
    (Collision::BlockBoth, Occupancy::Exact),
    (Collision::Soft, Occupancy::AsReleased),
    (Collision::Soft, Occupancy::Exact),
];

/// Returns whether an environment is in a state. Avoids [`Environment::snapshot`], which would allocate five lists.
pub fn is_in(environment: &impl Environment, expected: &Snapshot) -> bool {
    let actual = environment.state();
    actual == expected.state(actual.step) && environment.occupied() == expected.occupied
}

/// Sums the counts of a check over all maps of some scopes, in parallel.
pub fn count_over_maps(scopes: &[Scope], check: fn(Scope, &Map) -> u64) -> u64 {
    let maps: Vec<(Scope, usize)> =
        scopes.iter().flat_map(|&scope| (0..scope.num_maps()).map(move |index| (scope, index))).collect();
    let (next, total) = (AtomicUsize::new(0), AtomicU64::new(0));
    let work = || {
        while let Some(&(scope, index)) = maps.get(next.fetch_add(1, Relaxed)) {
            total.fetch_add(check(scope, &scope.map(index)), Relaxed);
        }
    };
    let num_threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..num_threads {
            scope.spawn(work);
        }
    });
    total.into_inner()
}
