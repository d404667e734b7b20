//! Follower's planner: one path for each agent, searched anew in every step.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use pogema_core::{Cell, Error, Map, Occupancy, State, words};
use pogema_planners::Graph;

use crate::follower::search::{OBSTACLE, Search, heuristic};
use crate::follower::static_costs::static_costs;
use crate::grid::{Layout, Marks};

words! {
    /// The two versions of Follower that its authors released.
    ///
    /// | | `cpp` | `python` |
    /// | --- | --- | --- |
    /// | agents that raise the cost of their cells | all within sight | the marked ones within sight |
    /// | end of the drawn path | its first cell outside the window | its first cell outside of sight |
    /// | agent on its goal | no path | keeps its last path |
    #[derive(Default)]
    pub enum FollowerVersion {
        /// The C++ version, which plays Follower-lite.
        #[default]
        Cpp = "cpp",
        /// The Python version, which plays Follower.
        Python = "python",
    }
}

/// The planner of all agents of an environment.
///
/// Source: Follower, `follower_cpp/planner.h`
#[derive(Debug)]
pub(crate) struct FollowerPlanner {
    layout: Layout,
    sight: usize,
    version: FollowerVersion,
    /// The static cost of each place, and the same plus the dynamic cost of the agent that plans.
    static_costs: Vec<f32>,
    costs: Vec<f32>,
    /// For each place, the index of its entry in the dynamic costs of the agent that plans, plus 1; 0 if it has none.
    entries: Vec<u32>,
    /// The marks of the agents that raise costs.
    present: Marks,
    heuristics: HashMap<Cell, Arc<[f32]>>,
    max_heuristics: usize,
    agents: Vec<Agent>,
    search: Search,
}

/// The memory of an agent.
#[derive(Clone, Debug)]
struct Agent {
    goal: Option<Cell>,
    heuristic: Arc<[f32]>,
    /// How often each place was seen occupied since the agent got its goal.
    dynamic: Vec<(u32, f32)>,
    path: Vec<u32>,
}

impl FollowerPlanner {
    /// Prepares the planner for episodes on a map. `max_bytes` is the budget of all heuristics; beyond it,
    /// those that no agent currently uses are evicted.
    pub fn new(layout: Layout, map: &Map, sight: usize, version: FollowerVersion, max_bytes: usize) -> Self {
        let graph = Graph::new(map);
        let mut costs = vec![OBSTACLE; layout.len()];
        for (vertex, cost) in (0..).zip(static_costs(&graph)) {
            costs[layout.place(graph.cell(vertex))] = cost;
        }
        Self {
            layout,
            sight,
            version,
            costs: costs.clone(),
            static_costs: costs,
            entries: vec![0; layout.len()],
            present: Marks::new(layout, Occupancy::Exact),
            heuristics: HashMap::new(),
            max_heuristics: (max_bytes / (size_of::<f32>() * layout.len())).max(1),
            agents: Vec::new(),
            search: Search::new(layout.len(), layout.stride()),
        }
    }

    /// Begins an episode. `present` follows the agents that raise costs.
    pub fn begin(&mut self, num_agents: usize, present: Marks) {
        let agent = Agent { goal: None, heuristic: Arc::new([]), dynamic: Vec::new(), path: Vec::new() };
        self.agents.clear();
        self.agents.resize(num_agents, agent);
        self.present = present;
    }

    /// Plans for all active agents.
    ///
    /// # Errors
    /// [`Error::Cancelled`] if another thread sets `stop`.
    pub fn plan(&mut self, state: State<'_>, stop: &AtomicBool) -> Result<(), Error> {
        self.present.follow(state);
        for (agent, (&cell, &goal)) in state.cells.iter().zip(state.goals).enumerate() {
            if stop.load(Relaxed) {
                return Err(Error::Cancelled);
            }
            let keeps = self.version == FollowerVersion::Python && cell == goal;
            if state.active[agent] && !keeps {
                self.plan_one(agent, cell, goal);
            }
        }
        Ok(())
    }

    /// Returns the path of an agent from its place on.
    pub fn path(&self, agent: usize, place: usize) -> impl Iterator<Item = usize> + '_ {
        // A path kept from an earlier step begins at the agent's cell in that step.
        self.agents[agent].path.iter().map(|&place| place as usize).skip_while(move |&known| known != place)
    }

    /// Returns the distance from the agent, in rows or columns, beyond which its path is not drawn.
    pub fn cut(&self, radius: usize) -> usize {
        match self.version {
            FollowerVersion::Cpp => radius,
            FollowerVersion::Python => self.sight,
        }
    }

    fn plan_one(&mut self, agent: usize, cell: Cell, goal: Cell) {
        let (start, end) = (self.layout.place(cell), self.layout.place(goal));
        if self.agents[agent].goal != Some(goal) {
            let heuristic = self.heuristic(goal);
            let known = &mut self.agents[agent];
            (known.goal, known.heuristic) = (Some(goal), heuristic);
            known.dynamic.clear();
        }
        let Self { layout, agents, entries, costs, static_costs, search, .. } = self;
        let Agent { dynamic, heuristic, path, .. } = &mut agents[agent];
        for (index, &(place, _)) in (1..).zip(dynamic.iter()) {
            entries[place as usize] = index;
        }
        let side = 2 * self.sight + 1;
        for first in layout.window_rows(start, self.sight) {
            let row = &self.present.grid()[first..first + side];
            for place in (first..).zip(row).filter(|&(place, &mark)| mark != 0.0 && place != start) {
                let entry = &mut entries[place.0];
                if *entry == 0 {
                    dynamic.push((place.0 as u32, 0.0));
                    *entry = dynamic.len() as u32;
                }
                dynamic[*entry as usize - 1].1 += 1.0;
            }
        }
        for &(place, cost) in dynamic.iter() {
            costs[place as usize] = static_costs[place as usize] + cost;
            entries[place as usize] = 0;
        }
        search.find(start, end, costs, heuristic, path);
        for &(place, _) in dynamic.iter() {
            costs[place as usize] = static_costs[place as usize];
        }
    }

    fn heuristic(&mut self, goal: Cell) -> Arc<[f32]> {
        if let Some(known) = self.heuristics.get(&goal) {
            return known.clone();
        }
        if self.heuristics.len() >= self.max_heuristics {
            self.heuristics.retain(|_, known| Arc::strong_count(known) > 1);
        }
        let made: Arc<[f32]> =
            heuristic(self.layout.place(goal), &self.static_costs, self.layout.stride()).into();
        self.heuristics.insert(goal, made.clone());
        made
    }
}
