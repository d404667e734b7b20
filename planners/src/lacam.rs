//! LaCAM*: a quick first plan, then better and better ones until the budget is spent.
//!
//! Papers: those of `search`, which finds plans and can prove that there is none, and of `refine`, which makes them
//! better; Okumura, "Engineering LaCAM*", AAMAS 2024, where the two go side by side.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::distances::CostToGo;
use crate::graph::Vertex;
use crate::parts::{Part, small_parts};
use crate::problem::{Budget, Clock, Outcome, Planner, Problem};
use crate::refine::{self, Refiner, Shared};
use crate::scatter::scatter;
use crate::search::{Loss, Progress, Search, SearchRules};
use crate::stepper::PibtRules;

/// How LaCAM goes about it.
#[derive(Clone, Debug)]
pub struct LacamParams {
    /// Seed of all that is random.
    pub seed: u64,
    /// How single steps are decided.
    pub pibt: PibtRules,
    /// Threads, of which all but the first only refine. With more than one, the same seed may give another plan.
    pub threads: usize,
    /// Whether plans are made better once there is one.
    pub refine: bool,
    /// Whether a second plan, for agents that keep apart from afar, is made before the better one is refined; of use
    /// where there is no time to refine, since after a second of that the two are equally good.
    pub scatter: bool,
    /// Attempts to make a plan better, one after the other in vain, after which a planner without a bound on its time
    /// and nodes is done.
    pub patience: u64,
    /// Most bytes that the nodes of a search may take, and as much again for the tables of those who refine. The costs
    /// to go take four bytes more for each agent and free cell.
    pub most_bytes: usize,
}

impl Default for LacamParams {
    fn default() -> Self {
        Self {
            seed: 0,
            pibt: PibtRules::default(),
            threads: 1,
            refine: true,
            scatter: false,
            patience: 20_000,
            most_bytes: 256 << 20,
        }
    }
}

/// The planner LaCAM*; a node of its budget is a configuration, or one attempt to refine a plan.
#[derive(Clone, Debug, Default)]
pub struct Lacam {
    params: LacamParams,
}

impl Lacam {
    /// The planner of these parameters.
    pub fn new(params: LacamParams) -> Self {
        Self { params }
    }
}

impl Planner for Lacam {
    fn name(&self) -> &'static str {
        "lacam"
    }

    fn plan(&mut self, problem: &Problem, budget: &Budget) -> Outcome {
        let mut clock = budget.start();
        let costs = match problem.survey(&mut clock) {
            Ok(costs) => costs,
            Err(outcome) => return outcome,
        };
        Work::new(&self.params, problem, &costs, budget, clock).run()
    }
}

/// Configurations after one another.
type Steps = Vec<Vec<Vertex>>;

/// One call of the planner.
struct Work<'a> {
    params: &'a LacamParams,
    problem: &'a Problem,
    costs: &'a [CostToGo],
    clock: Clock,
    is_bounded: bool,
    search: Search<'a>,
    is_searching: bool,
    lower_bound: u64,
}

/// What came of a search.
enum Found {
    Plan(Steps),
    Impossible,
    /// Nothing, for the budget is spent.
    Spent,
}

impl<'a> Work<'a> {
    fn new(
        params: &'a LacamParams,
        problem: &'a Problem,
        costs: &'a [CostToGo],
        budget: &Budget,
        clock: Clock,
    ) -> Self {
        let lower_bound = problem.lower_bound(costs);
        let search = Search::new(problem, costs, rules(params, 0, Loss::Sum));
        let is_bounded = budget.time.is_some() || budget.nodes.is_some();
        Self { params, problem, costs, clock, is_bounded, search, is_searching: true, lower_bound }
    }

    fn run(mut self) -> Outcome {
        if let Some(reason) = self.impossible_part() {
            return Outcome::Impossible { reason };
        }
        let mut found = self.find_first();
        if let Found::Plan(steps) = found {
            found = self.better(steps);
        }
        match found {
            Found::Plan(steps) => self.answer(steps),
            Found::Impossible => impossible(),
            Found::Spent => {
                let best = self.problem.plan(&self.within_cap(self.search.closest())).ok();
                self.clock.unsolved(best, self.lower_bound)
            }
        }
    }

    /// Which agents cannot do it in their small part of the map, as far as that is soon found out.
    fn impossible_part(&mut self) -> Option<String> {
        for Part { agents, problem, costs } in small_parts(self.problem, self.costs) {
            let mut search = Search::new(&problem, &costs, rules(self.params, 0, Loss::Sum));
            if let Advance::Found(Found::Impossible) = advance(&mut search, &mut self.clock, PART_NODES) {
                return Some(format!("all that agents {agents:?} can do in their part of the map was tried"));
            }
        }
        None
    }

    fn answer(&mut self, steps: Steps) -> Outcome {
        let is_late = self.is_late(&steps);
        match self.problem.plan(&self.within_cap(steps)) {
            Ok(plan) if is_late => self.clock.unsolved(Some(plan), self.lower_bound),
            Ok(plan) => Outcome::Solved { plan, lower_bound: self.lower_bound },
            Err(_) => self.clock.unsolved(None, self.lower_bound),
        }
    }

    fn is_late(&self, steps: &Steps) -> bool {
        self.problem.most_steps.is_some_and(|most| steps.len() > most.saturating_add(1))
    }

    /// What fits the cap of a plan.
    fn within_cap(&self, mut steps: Steps) -> Steps {
        steps.truncate(self.problem.most_steps.map_or(usize::MAX, |most| most.saturating_add(1)));
        steps
    }

    /// Goes on with one search for good, and in between begins others anew, each for a little longer.
    fn find_first(&mut self) -> Found {
        let mut most = 500;
        for attempt in 1_u64.. {
            match advance(&mut self.search, &mut self.clock, most) {
                Advance::Found(found) => return found,
                Advance::Full if !self.is_bounded => return Found::Spent,
                Advance::Full | Advance::Going => {}
            }
            let mut other = Search::new(self.problem, self.costs, rules(self.params, attempt, Loss::Sum));
            if let Advance::Found(found) = advance(&mut other, &mut self.clock, most) {
                return found;
            }
            most += most / 4;
        }
        Found::Spent
    }

    /// Makes a plan better until the budget is spent or it is known to be the best.
    fn better(&mut self, first: Steps) -> Found {
        if self.is_late(&first) {
            self.search = Search::new(self.problem, self.costs, rules(self.params, 0, Loss::Steps));
            self.search.set_bound(self.problem.most_steps.map_or(u64::MAX, |most| most as u64 + 1));
        }
        let first = if self.params.scatter { self.scattered(first) } else { first };
        let threads = self.threads(first.len());
        if threads == 0 {
            return Found::Plan(first);
        }
        let (problem, costs, seed) = (self.problem, self.costs, self.params.seed);
        let shared = Shared::new(threads == 1);
        let is_done = AtomicBool::new(false);
        let mut refiner = Refiner::new(problem, costs, &first, &shared, seed);
        refiner.begin(|| self.clock.is_spent());
        std::thread::scope(|scope| {
            for thread in 1..threads {
                let (first, shared, is_done) = (&first, &shared, &is_done);
                let seed = seed.wrapping_add(thread as u64);
                scope.spawn(move || {
                    let mut refiner = Refiner::new(problem, costs, first, shared, seed);
                    while !is_done.load(Ordering::Relaxed) && refiner.total_delay() > 0 {
                        refiner.improve();
                    }
                });
            }
            let is_possible = self.refine_and_search(&mut refiner);
            is_done.store(true, Ordering::Relaxed);
            if is_possible { Found::Plan(refiner.plan()) } else { Found::Impossible }
        })
    }

    /// The better of a plan and one for agents that keep apart.
    fn scattered(&mut self, first: Steps) -> Steps {
        let hints = scatter(self.problem, self.costs, &mut self.clock);
        let search = Search::new(self.problem, self.costs, rules(self.params, 0, Loss::Sum));
        let mut search = search.following(hints);
        match advance(&mut search, &mut self.clock, 2 * first.len()) {
            Advance::Found(Found::Plan(second)) if total(&second) < total(&first) => second,
            _ => first,
        }
    }

    /// Number of threads that may refine; each has its own tables.
    fn threads(&self, num_steps: usize) -> usize {
        if !self.params.refine || !refine::fits(self.problem) {
            return 0;
        }
        let room = self.params.most_bytes / refine::bytes(self.problem, num_steps).max(1);
        self.params.threads.max(1).min(room)
    }

    /// Refines, and the longer in vain, the more looks at further configurations in between; whether there may be a
    /// plan within the cap.
    fn refine_and_search(&mut self, refiner: &mut Refiner<'_>) -> bool {
        let mut idle: u64 = 0;
        while refiner.cost().is_none_or(|cost| cost > self.lower_bound) {
            for _ in 0..ATTEMPTS {
                if self.clock.count_node() {
                    return true;
                }
                idle = if refiner.improve() { 0 } else { idle + 1 };
            }
            if !self.is_bounded && idle > self.params.patience {
                return true;
            }
            if let Some(cost) = refiner.cost().filter(|_| self.search.minimises() == Loss::Sum) {
                self.search.set_bound(cost);
            }
            let is_late = refiner.cost().is_none();
            let most = if is_late { 64 } else { (idle / 16).clamp(8, 256) };
            if self.is_searching && !self.look_further(refiner, most) {
                return false;
            }
        }
        true
    }

    /// Looks at so many nodes more, and takes over what is found; whether there may be a plan within the cap.
    fn look_further(&mut self, refiner: &mut Refiner<'_>, most: u64) -> bool {
        for _ in 0..most {
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
                Progress::Exhausted if self.search.minimises() == Loss::Sum => {
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

/// The steps of all agents until they stay.
fn total(steps: &Steps) -> usize {
    refine::paths_of(steps).iter().map(|path| path.len() - 1).sum()
}

/// Attempts to refine between two looks at further configurations.
const ATTEMPTS: usize = 32;

/// Nodes for one small part of the map.
const PART_NODES: usize = 20_000;

fn impossible() -> Outcome {
    Outcome::Impossible { reason: "all that the agents can do was tried".to_owned() }
}

fn rules(params: &LacamParams, attempt: u64, loss: Loss) -> SearchRules {
    let seed = params.seed.wrapping_add(attempt.wrapping_mul(0x9e37_79b9));
    SearchRules { loss, pibt: params.pibt, most_bytes: params.most_bytes, seed }
}

/// What came of some more nodes.
enum Advance {
    Found(Found),
    Full,
    Going,
}

/// Lets a search look at so many nodes.
fn advance(search: &mut Search<'_>, clock: &mut Clock, most: usize) -> Advance {
    for _ in 0..most {
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
