//! One call of LaCAM*: finds a first plan, then alternates refinement and search.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::budget::{Budget, Clock};
use crate::distances::CostToGo;
use crate::graph::Vertex;
use crate::lacam::components::{Component, small_components};
use crate::lacam::lns::{self, ChangeLog, Refiner};
use crate::lacam::objective::Objective;
use crate::lacam::params::LacamParams;
use crate::lacam::search::{Progress, Search, SearchOptions};
use crate::outcome::Outcome;
use crate::problem::Problem;

/// The configurations at the start and after each step.
type Steps = Vec<Vec<Vertex>>;

/// One call of the planner.
pub(super) struct PlanCall<'a> {
    params: &'a LacamParams,
    problem: &'a Problem,
    costs: &'a [CostToGo],
    clock: Clock,
    is_bounded: bool,
    search: Search<'a>,
    is_searching: bool,
    lower_bound: u64,
}

/// The result of a search.
enum Found {
    Plan(Steps),
    Impossible,
    /// The budget is spent, or the byte budget is exceeded in a call without time and node limits.
    Spent,
}

impl<'a> PlanCall<'a> {
    /// Prepares a call with the costs to go of all agents.
    pub fn new(
        params: &'a LacamParams,
        problem: &'a Problem,
        costs: &'a [CostToGo],
        budget: &Budget,
        clock: Clock,
    ) -> Self {
        let lower_bound = problem.lower_bound(costs);
        let search = Search::new(problem, costs, options(params, 0, Objective::SumOfLoss));
        let is_bounded = budget.time.is_some() || budget.nodes.is_some();
        Self { params, problem, costs, clock, is_bounded, search, is_searching: true, lower_bound }
    }

    /// Finds a plan and refines it.
    pub fn run(mut self) -> Outcome {
        if let Some(reason) = self.impossible_component() {
            return Outcome::Impossible { reason };
        }
        let mut found = self.find_first();
        if let Found::Plan(steps) = found {
            found = self.refine(steps);
        }
        match found {
            Found::Plan(steps) => self.answer(steps),
            Found::Impossible => self.exhausted(),
            Found::Spent => {
                let best = self.problem.plan_of(&self.truncated(self.search.closest())).ok();
                self.clock.unsolved(best, self.lower_bound)
            }
        }
    }

    /// Searches the small components of the map. If the agents of a component cannot all reach their goals, returns the
    /// reason.
    fn impossible_component(&mut self) -> Option<String> {
        for Component { agents, problem, costs } in small_components(self.problem, self.costs) {
            let mut search = Search::new(&problem, &costs, options(self.params, 0, Objective::SumOfLoss));
            if let Advance::Found(Found::Impossible) = advance(&mut search, &mut self.clock, COMPONENT_NODES)
            {
                return Some(format!(
                    "the search exhausted all configurations of agents {agents:?} in their component"
                ));
            }
        }
        None
    }

    fn answer(&mut self, steps: Steps) -> Outcome {
        let is_late = self.is_late(&steps);
        match self.problem.plan_of(&self.truncated(steps)) {
            Ok(plan) if is_late => self.clock.unsolved(Some(plan), self.lower_bound),
            Ok(plan) => Outcome::Solved { plan, lower_bound: self.lower_bound },
            Err(_) => self.clock.unsolved(None, self.lower_bound),
        }
    }

    /// Returns the outcome of a search that was exhausted. A search for the makespan prunes late configurations.
    fn exhausted(&self) -> Outcome {
        let within = match self.search.objective() {
            Objective::SumOfLoss => String::new(),
            Objective::Makespan => {
                format!(" within the step limit of {}", self.problem.max_steps.unwrap_or(usize::MAX))
            }
        };
        Outcome::Impossible { reason: format!("the search exhausted all configurations{within}") }
    }

    fn is_late(&self, steps: &Steps) -> bool {
        self.problem.max_steps.is_some_and(|most| steps.len() > most.saturating_add(1))
    }

    /// Truncates steps to the step limit.
    fn truncated(&self, mut steps: Steps) -> Steps {
        steps.truncate(self.problem.max_steps.map_or(usize::MAX, |most| most.saturating_add(1)));
        steps
    }

    /// Continues one search, and alternates it with restarts, each with a larger node limit.
    fn find_first(&mut self) -> Found {
        let mut max_nodes = 500;
        for attempt in 1_u64.. {
            match advance(&mut self.search, &mut self.clock, max_nodes) {
                Advance::Found(found) => return found,
                Advance::Full if !self.is_bounded => return Found::Spent,
                Advance::Full | Advance::Going => {}
            }
            let mut other =
                Search::new(self.problem, self.costs, options(self.params, attempt, Objective::SumOfLoss));
            if let Advance::Found(found) = advance(&mut other, &mut self.clock, max_nodes) {
                return found;
            }
            max_nodes = max_nodes.saturating_add(max_nodes / 4);
        }
        Found::Spent
    }

    /// Refines a plan until it is proved optimal or the budget is spent. Without time and node limits, the refinement
    /// also stops when [`LacamParams::patience`] runs out.
    fn refine(&mut self, first: Steps) -> Found {
        if self.is_late(&first) {
            self.search = Search::new(self.problem, self.costs, options(self.params, 0, Objective::Makespan));
            self.search.set_bound(self.problem.max_steps.map_or(u64::MAX, |limit| limit as u64 + 1));
        }
        let num_threads = self.num_threads(first.len());
        if num_threads == 0 {
            return Found::Plan(first);
        }
        let (problem, costs, seed) = (self.problem, self.costs, self.params.seed);
        let log = ChangeLog::new(num_threads == 1);
        let is_done = AtomicBool::new(false);
        let mut refiner = Refiner::new(problem, costs, &first, log.worker(), seed);
        let others: Vec<_> = (1..num_threads).map(|_| log.worker()).collect();
        refiner.replan_all(|| self.clock.is_spent());
        std::thread::scope(|scope| {
            // The other threads also end if this one panics.
            let _done = SetOnDrop(&is_done);
            for (thread, changes) in (1..).zip(others) {
                let (first, is_done) = (&first, &is_done);
                let seed = seed.wrapping_add(thread);
                let refine = move || {
                    let mut refiner = Refiner::new(problem, costs, first, changes, seed);
                    while !is_done.load(Ordering::Relaxed) && refiner.total_delay() > 0 {
                        refiner.improve();
                    }
                };
                // If the system cannot start another thread, the running threads suffice.
                if std::thread::Builder::new().spawn_scoped(scope, refine).is_err() {
                    break;
                }
            }
            let is_possible = self.refine_and_search(&mut refiner);
            if is_possible { Found::Plan(refiner.plan()) } else { Found::Impossible }
        })
    }

    /// Returns the number of threads that refine; each thread has its own tables.
    fn num_threads(&self, num_steps: usize) -> usize {
        if !self.params.refine || !lns::supports(self.problem) {
            return 0;
        }
        let room = self.params.max_bytes / lns::num_bytes(self.problem, num_steps).max(1);
        self.params.threads.max(1).min(room)
    }

    /// Alternates refinement and search; the longer refinement fails, the more nodes the search expands. Returns
    /// whether a plan within the step limit may exist.
    fn refine_and_search(&mut self, refiner: &mut Refiner<'_>) -> bool {
        let mut idle: u64 = 0;
        while refiner.cost().is_none_or(|cost| cost > self.lower_bound) {
            for _ in 0..NUM_ATTEMPTS {
                if self.clock.count_node() {
                    return true;
                }
                idle = if refiner.improve() { 0 } else { idle + 1 };
            }
            if !self.is_bounded && idle > self.params.patience {
                return true;
            }
            if let Some(cost) = refiner.cost().filter(|_| self.search.objective() == Objective::SumOfLoss) {
                self.search.set_bound(cost);
            }
            let is_late = refiner.cost().is_none();
            let max_nodes = if is_late { 64 } else { (idle / 16).clamp(8, 256) };
            if self.is_searching && !self.search_further(refiner, max_nodes) {
                return false;
            }
        }
        true
    }

    /// Expands nodes and adopts a better plan. Returns whether a plan within the step limit may exist.
    fn search_further(&mut self, refiner: &mut Refiner<'_>, max_nodes: u64) -> bool {
        for _ in 0..max_nodes {
            if self.clock.count_node() {
                return true;
            }
            match self.search.expand() {
                Progress::Going => {}
                Progress::Full => self.is_searching = false,
                Progress::Better => {
                    if let Some(steps) = self.search.solution() {
                        refiner.replace(&steps);
                    }
                }
                Progress::Exhausted if self.search.objective() == Objective::SumOfLoss => {
                    self.lower_bound = self.lower_bound.max(self.search.bound());
                    self.is_searching = false;
                }
                Progress::Exhausted => {
                    self.is_searching = false;
                    return refiner.cost().is_some();
                }
            }
            if !self.is_searching {
                return true;
            }
        }
        true
    }
}

/// Sets a flag when it is dropped.
struct SetOnDrop<'a>(&'a AtomicBool);

impl Drop for SetOnDrop<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Refinement attempts between two turns of the search.
const NUM_ATTEMPTS: usize = 32;

/// Node limit for one small component of the map.
const COMPONENT_NODES: usize = 20_000;

fn options(params: &LacamParams, attempt: u64, objective: Objective) -> SearchOptions {
    let seed = params.seed.wrapping_add(attempt.wrapping_mul(0x9e37_79b9));
    SearchOptions { objective, pibt: params.pibt, max_bytes: params.max_bytes, seed }
}

/// The state of a search after it expanded more nodes.
enum Advance {
    Found(Found),
    Full,
    Going,
}

/// Lets a search expand a number of nodes.
fn advance(search: &mut Search<'_>, clock: &mut Clock, max_nodes: usize) -> Advance {
    for _ in 0..max_nodes {
        if let Some(steps) = search.solution() {
            return Advance::Found(Found::Plan(steps));
        }
        if clock.count_node() {
            return Advance::Found(Found::Spent);
        }
        match search.expand() {
            Progress::Exhausted => return Advance::Found(Found::Impossible),
            Progress::Full => return Advance::Full,
            Progress::Going | Progress::Better => {}
        }
    }
    search.solution().map_or(Advance::Going, |steps| Advance::Found(Found::Plan(steps)))
}
