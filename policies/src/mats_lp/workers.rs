//! The searches of a step, distributed over threads.

use std::sync::atomic::{AtomicBool, Ordering};

use pogema_core::{Action, Error};

use crate::mats_lp::cache::Cache;
use crate::mats_lp::evaluator::Evaluator;
use crate::mats_lp::params::MatsLpParams;
use crate::mats_lp::search::Search;
use crate::mats_lp::simulation::{Goals, Simulation};
use crate::mats_lp::tree::{RootChild, Tree};
use crate::mats_lp::world::World;

/// The input of the searches of a step.
pub(super) struct Task<'a> {
    pub params: MatsLpParams,
    pub radius: usize,
    pub world: &'a World,
    pub cache: &'a Cache,
    pub cells: &'a [pogema_core::Cell],
    pub goals: &'a [Goals<'a>],
    /// The smallest cost that each agent has had to its goal.
    pub best: &'a [i32],
    pub step: u64,
    pub cancelled: Option<&'a AtomicBool>,
}

/// The result of a search: the agent, its action, and the children of the root.
pub(super) struct Found {
    pub agent: usize,
    pub action: Action,
    pub root: Vec<RootChild>,
}

/// Runs the searches of all groups, and returns the result for the first agent of each.
///
/// Each evaluator is used by one thread. The actions do not depend on the number of threads.
///
/// # Errors
/// [`Error::Cancelled`]; [`Error::Corrupt`] for the first agent whose search meets outputs that are not finite; the
/// errors of the network.
pub(super) fn search_all(
    task: &Task<'_>,
    mut groups: Vec<Vec<usize>>,
    evaluators: &mut [Evaluator],
) -> Result<Vec<Found>, Error> {
    // The largest groups take longest, so they are distributed first.
    groups.sort_by_key(|group| (std::cmp::Reverse(group.len()), group[0]));
    let num_threads = evaluators.len();
    let mut shares: Vec<Vec<Vec<usize>>> = vec![Vec::new(); num_threads];
    for (index, group) in groups.into_iter().enumerate() {
        shares[index % num_threads].push(group);
    }
    let mut work = evaluators.iter_mut().zip(shares);
    let first = work.next();
    let results: Vec<Result<Vec<Found>, Failure>> = std::thread::scope(|scope| {
        let others: Vec<_> = work
            .map(|(evaluator, groups)| scope.spawn(move || search_some(task, groups, evaluator)))
            .collect();
        let own = first.map(|(evaluator, groups)| search_some(task, groups, evaluator));
        let joined = others.into_iter().map(|thread| match thread.join() {
            Ok(result) => result,
            Err(panic) => std::panic::resume_unwind(panic),
        });
        own.into_iter().chain(joined).collect()
    });
    let mut answers = Vec::new();
    let mut failures = Vec::new();
    for result in results {
        match result {
            Ok(some) => answers.extend(some),
            Err(failure) => failures.push(failure),
        }
    }
    match failures.into_iter().min_by_key(|failure| failure.agent) {
        Some(failure) => Err(failure.error),
        None => Ok(answers),
    }
}

/// The error of a thread, and the first agent of the group whose search failed; `None` if the error concerns no search.
/// Such an error is reported first.
struct Failure {
    agent: Option<usize>,
    error: Error,
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self { agent: None, error }
    }
}

/// Runs the searches of some groups on one thread. The searches that advance together share the batches of the network.
fn search_some(
    task: &Task<'_>,
    groups: Vec<Vec<usize>>,
    evaluator: &mut Evaluator,
) -> Result<Vec<Found>, Failure> {
    let mut waiting = groups.iter().map(|group| (group.as_slice(), new_search(task, group)));
    let num_searches = num_searches(&task.params);
    let mut searches: Vec<(&[usize], Search<'_>)> = waiting.by_ref().take(num_searches).collect();
    // After an error, the evaluator may still hold requests of an earlier episode.
    evaluator.clear();
    let mut answers = Vec::new();
    let mut failed: Option<Failure> = None;
    while !searches.is_empty() {
        if task.cancelled.is_some_and(|flag| flag.load(Ordering::Relaxed)) {
            return Err(Error::Cancelled.into());
        }
        searches.retain_mut(|(group, search)| match search.advance(evaluator, task.cache, task.radius) {
            Ok(false) => true,
            Ok(true) => {
                let (action, root) = (search.answer(), search.root_children());
                answers.push(Found { agent: group[0], action, root });
                false
            }
            Err(position) => {
                let failure = not_finite(task, group, position);
                if failed.as_ref().is_none_or(|failed| failure.agent < failed.agent) {
                    failed = Some(failure);
                }
                false
            }
        });
        evaluator.run(task.cache)?;
        searches.extend(waiting.by_ref().take(num_searches - searches.len()));
    }
    failed.map_or(Ok(answers), Err)
}

/// Returns the number of searches that advance together on one thread. They fill the batches of the network, and their
/// trees take at most about [`MAX_BYTES`], unless a single tree takes more.
fn num_searches(params: &MatsLpParams) -> usize {
    let num_children = Action::ALL.len().pow(params.agents_to_plan as u32) * params.expansions as usize;
    (MAX_BYTES / (num_children * Tree::CHILD_BYTES)).clamp(1, Evaluator::MAX_ROWS)
}

/// The memory of the trees of one thread. Units: bytes.
const MAX_BYTES: usize = 64 << 20;

fn new_search<'a>(task: &Task<'a>, group: &[usize]) -> Search<'a> {
    let mut simulation = Simulation::new(task.world, task.params.progress_reward);
    for &agent in group {
        simulation.add(task.cells[agent], task.goals[agent], task.best[agent]);
    }
    Search::new(task.params, simulation)
}

fn not_finite(task: &Task<'_>, group: &[usize], position: usize) -> Failure {
    let (agent, step) = (group[position], task.step);
    let reason = format!("its outputs for agent {agent} in step {step} are not finite");
    Failure { agent: Some(group[0]), error: Error::Corrupt { what: "network".into(), reason } }
}
