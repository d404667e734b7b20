//! An explicit episode that can be shrunk piece by piece.

use pogema_core::{Cell, OnGoal};
use pogema_maps::{GridConfig, InstanceSource};
use serde_json::{Map as Object, Value, json};

use crate::draw::text;
use crate::request::{Op, Record, Request, Response, numbers};

/// An episode: a map, agents, operations, and the config fields that do not concern map or agents.
#[derive(Clone, Debug, PartialEq)]
pub struct TestEpisode {
    /// Whether each cell has an obstacle, row by row.
    pub rows: Vec<Vec<bool>>,
    /// The start of each agent.
    pub starts: Vec<Cell>,
    /// The goals of each agent, in order.
    pub goals: Vec<Vec<Cell>>,
    /// The argument `seed` of the reset.
    pub reset_seed: Option<u64>,
    /// The operations after the reset.
    pub ops: Vec<Op>,
    /// Whether an agent that reaches its goal gets a new one.
    pub restarts: bool,
    /// The other config fields.
    pub fields: Object<String, Value>,
    /// Whether the density of agents is measured.
    pub density: bool,
    /// Whether collisions are counted.
    pub collisions: bool,
}

impl TestEpisode {
    /// Returns the episode of a request that contains the operation at `until`, up to that operation.
    ///
    /// Returns `None` if there is no such episode or its instance cannot be generated.
    pub fn of(request: &Request, expected: &Response, until: usize) -> Option<Self> {
        let config = GridConfig::from_value(&request.config).ok()?;
        let until = until.min(request.ops.len().checked_sub(1)?);
        let begin = (0..=until).rev().find(|&at| matches!(request.ops[at], Op::Reset(_)))?;
        let mut source = request.source(&config).ok()?;
        let num_resets = request.ops[..=begin].iter().filter(|op| matches!(op, Op::Reset(_))).count();
        let mut instance = source.generate().ok()?.instance;
        for _ in 1..num_resets {
            instance = source.generate().ok()?.instance;
        }
        let Op::Reset(reset_seed) = request.ops[begin] else { return None };
        let restarts = config.on_target == OnGoal::Restart;
        let num_goals = if restarts { until - begin + 2 } else { 1 };
        let map = instance.map();
        let rows = map.obstacles().chunks(map.width()).map(<[bool]>::to_vec).collect();
        let ops = request.ops[begin + 1..=until]
            .iter()
            .zip(begin + 1..)
            .map(|(op, at)| without_policy(op, at, expected));
        Some(Self {
            rows,
            starts: instance.starts().to_vec(),
            goals: instance.goals().iter().map(|stream| stream.list(num_goals)).collect(),
            reset_seed,
            ops: ops.collect(),
            restarts,
            fields: fields(&config),
            density: request.density,
            collisions: request.collisions,
        })
    }

    /// Returns the episode as a request.
    pub fn request(&self) -> Request {
        let mut config = Object::new();
        config.insert("map".into(), text(&self.rows).into());
        config.extend(self.fields.clone());
        config.extend(self.positions());
        let ops = std::iter::once(Op::Reset(self.reset_seed)).chain(self.ops.iter().cloned()).collect();
        Request {
            id: 0,
            config: Value::Object(config),
            register: None,
            density: self.density,
            collisions: self.collisions,
            ops,
        }
    }

    /// Returns the config fields that give starts and goals.
    fn positions(&self) -> Object<String, Value> {
        let first: Vec<Cell> = self.goals.iter().filter_map(|goals| goals.first().copied()).collect();
        let is_obstacle = |cell: &Cell| self.rows[usize::from(cell.row)][usize::from(cell.col)];
        // Explicit starts and goals clear the obstacles under them; those of pools do not.
        let is_on_obstacle = self.starts.iter().chain(&first).any(is_obstacle);
        let pools = if is_on_obstacle { self.pools(&first) } else { None };
        pools.unwrap_or_else(|| {
            let goals = if self.restarts { json!(self.goals) } else { json!(first) };
            [("agents_xy".into(), json!(self.starts)), ("targets_xy".into(), goals)].into_iter().collect()
        })
    }

    /// Returns pools whose shuffled order gives the starts and goals.
    ///
    /// Rule: place/pools
    fn pools(&self, goals: &[Cell]) -> Option<Object<String, Value>> {
        let seed = self.fields.get("seed").and_then(Value::as_u64).unwrap_or(0);
        let num_agents = self.num_agents();
        // The shuffle depends only on the seed and the size of the pools, so numbered pools show where each cell goes.
        let numbered: Vec<[usize; 2]> = (0..num_agents).map(|index| [0, index]).collect();
        let config = json!({
            "map": ".".repeat(num_agents.max(2)), "num_agents": num_agents, "seed": seed,
            "possible_agents_xy": numbered, "possible_targets_xy": numbered,
        });
        let config = GridConfig::from_value(&config).ok()?;
        let drawn = InstanceSource::new(config, None).ok()?.generate().ok()?.instance;
        let unshuffled = |drawn: &[Cell], cells: &[Cell]| {
            let mut pool = cells.to_vec();
            for (from, &cell) in drawn.iter().zip(cells) {
                pool[usize::from(from.col)] = cell;
            }
            json!(pool)
        };
        let fields = [
            ("num_agents", json!(num_agents)),
            ("seed", json!(seed)),
            ("possible_agents_xy", unshuffled(drawn.starts(), &self.starts)),
            ("possible_targets_xy", unshuffled(&drawn.first_goals(), goals)),
        ];
        Some(fields.into_iter().map(|(name, value)| (name.to_owned(), value)).collect())
    }

    /// Returns the number of agents.
    pub fn num_agents(&self) -> usize {
        self.starts.len()
    }

    /// Returns the episode that begins after some of the operations, with the agents that are still active.
    pub fn begun_after(&self, num_ops: usize, played: &Response) -> Option<Self> {
        let state = played.records.get(num_ops)?.state()?;
        let passed = &played.records[1..=num_ops];
        if passed.iter().any(|record| record.step().is_none()) {
            return None;
        }
        let kept: Vec<usize> = (0..self.num_agents()).filter(|&agent| state.active[agent]).collect();
        let mut later = self.clone();
        later.ops.drain(..num_ops);
        later.starts = kept.iter().map(|&agent| state.cells[agent]).collect();
        later.goals = kept
            .iter()
            .map(|&agent| {
                let mut goals = self.goals[agent].clone();
                let reached = |record: &&Record| record.state().is_some_and(|state| state.on_goal[agent]);
                let num_reached = if self.restarts { passed.iter().filter(reached).count() } else { 0 };
                let length = goals.len();
                goals.rotate_left(num_reached % length.max(1));
                goals
            })
            .collect();
        later.keep_actions(&kept);
        later.set_max_steps(self.max_steps().saturating_sub(num_ops as i64));
        Some(later)
    }

    /// Returns the step limit.
    pub fn max_steps(&self) -> i64 {
        let given = self.fields.get("max_episode_steps").and_then(Value::as_i64);
        given.unwrap_or_else(|| GridConfig::default().max_episode_steps)
    }

    /// Sets the step limit (at least 1).
    pub fn set_max_steps(&mut self, max_steps: i64) {
        self.fields.insert("max_episode_steps".into(), max_steps.max(1).into());
    }

    /// Returns the episode without some agents.
    pub fn without_agents(&self, gone: &[usize]) -> Self {
        let kept: Vec<usize> = (0..self.num_agents()).filter(|agent| !gone.contains(agent)).collect();
        let mut fewer = self.clone();
        fewer.starts = kept.iter().map(|&agent| self.starts[agent]).collect();
        fewer.goals = kept.iter().map(|&agent| self.goals[agent].clone()).collect();
        fewer.keep_actions(&kept);
        fewer
    }

    fn keep_actions(&mut self, kept: &[usize]) {
        for op in &mut self.ops {
            if let Op::Step(actions) = op {
                *actions = kept.iter().filter_map(|&agent| actions.get(agent).copied()).collect();
            }
        }
    }

    /// Returns the episode without one row. Starts and goals there move to the row that takes its place.
    pub fn without_row(&self, row: usize) -> Self {
        let mut smaller = self.clone();
        smaller.rows.remove(row);
        let num_left = smaller.rows.len();
        smaller.move_cells(|cell| Cell::new(without_line(cell.row, row, num_left), cell.col));
        smaller
    }

    /// Returns the episode without one column. Starts and goals there move to the column that takes its place.
    pub fn without_col(&self, col: usize) -> Self {
        let mut smaller = self.clone();
        for row in &mut smaller.rows {
            row.remove(col);
        }
        let num_left = smaller.rows.first().map_or(0, Vec::len);
        smaller.move_cells(|cell| Cell::new(cell.row, without_line(cell.col, col, num_left)));
        smaller
    }

    fn move_cells(&mut self, to: impl Fn(Cell) -> Cell) {
        self.starts.iter_mut().chain(self.goals.iter_mut().flatten()).for_each(|cell| *cell = to(*cell));
    }
}

/// Returns the index of a row or column after one of them is removed.
fn without_line(index: u16, removed: usize, num_left: usize) -> u16 {
    (index - u16::from(usize::from(index) > removed)).min(num_left.saturating_sub(1) as u16)
}

/// Returns an operation, with the chosen actions instead of a policy.
fn without_policy(op: &Op, at: usize, expected: &Response) -> Op {
    let chosen = expected.records.get(at).and_then(Record::step);
    match (op, chosen) {
        (Op::Astar | Op::Sample, Some(step)) => Op::Step(numbers(&step.step.actions)),
        _ => op.clone(),
    }
}

/// Returns the config fields that do not concern map or agents and differ from their defaults.
fn fields(config: &GridConfig) -> Object<String, Value> {
    const FIELDS: [&str; 10] = [
        "on_target",
        "collision_system",
        "observation_type",
        "obs_radius",
        "max_episode_steps",
        "persistent",
        "empty_outside",
        "occupancy",
        "reward",
        "seed",
    ];
    let (values, default) = (config.to_value(), GridConfig::default().to_value());
    // Without noise, nothing is drawn from the seed.
    let counts = |name: &&str| *name != "seed" || !config.empty_outside;
    let differing = FIELDS.into_iter().filter(counts).filter(|name| values[name] != default[name]);
    differing.map(|name| (name.to_owned(), values[name].clone())).collect()
}
