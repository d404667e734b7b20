//! Work sharing between the calling thread and helper threads.

use std::hint::spin_loop;
use std::sync::atomic::{AtomicUsize, Ordering::Acquire, Ordering::Relaxed, Ordering::Release};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use pogema_core::{Error, MAX_THREADS};
use rayon::{ThreadPool, ThreadPoolBuilder};

/// Number of spins before the caller sleeps while it waits for the helpers: tens of microseconds.
const MAX_SPINS: usize = 1000;
/// Number of further spins, in which the helpers leave the scope.
const FINAL_SPINS: usize = 5;

/// Time for which a helper busy-waits for the next call. A Python program that does nothing else needs 7 to 50 µs
/// between two steps of 64 environments of 64 agents.
const LINGER: Duration = Duration::from_micros(60);

/// The calling thread and its helper threads.
///
/// The caller works, too. It then spins until the helpers are done, but sleeps after tens of microseconds. The helpers
/// spin until the next call, but sleep after [`LINGER`]. Handing a step to other threads, sleeping and waking up would
/// take as long as the steps of some lanes.
#[derive(Debug)]
pub struct Team {
    helpers: Option<ThreadPool>,
    /// The number of calls that have begun.
    calls: Arc<AtomicUsize>,
}

/// Nanoseconds of a step per agent, without observations.
const AGENT_NANOS: usize = 16;
/// Bytes of observations that are written in a nanosecond.
const BYTES_PER_NANO: usize = 32;
/// Nanoseconds of work that justify waking a thread for its share of a step.
const THREAD_NANOS: usize = 20_000;

/// Returns a number of threads that suits the steps of a batch: at most one per core, one per lane, and
/// [`MAX_THREADS`].
///
/// `bytes_per_agent` is the size of an agent's observation.
pub fn suited_threads(num_lanes: usize, num_agents: usize, bytes_per_agent: usize) -> usize {
    let num_cores = std::thread::available_parallelism().map_or(1, usize::from);
    let per_agent = AGENT_NANOS + bytes_per_agent / BYTES_PER_NANO;
    let nanos = num_lanes.saturating_mul(num_agents).saturating_mul(per_agent);
    (nanos / THREAD_NANOS).clamp(1, num_cores.min(num_lanes).clamp(1, MAX_THREADS))
}

impl Team {
    /// Creates a team of `num_threads` threads, the calling thread included.
    ///
    /// # Errors
    /// If threads cannot be started.
    pub fn new(num_threads: usize) -> Result<Self, Error> {
        let helpers =
            (num_threads > 1).then(|| ThreadPoolBuilder::new().num_threads(num_threads - 1).build());
        let helpers = helpers.transpose().map_err(|error| Error::external("threads", error))?;
        Ok(Self { helpers, calls: Arc::default() })
    }

    /// Returns the number of threads, the calling thread included.
    pub fn num_threads(&self) -> usize {
        1 + self.helpers.as_ref().map_or(0, ThreadPool::current_num_threads)
    }

    /// Does all parts of some work and returns the results in the order of the parts.
    ///
    /// Each thread begins at the start of its own share, whose data is in its cache from the last call. It then takes
    /// parts that no other thread has begun.
    pub fn share<P: Send, T: Send + Sync>(&self, parts: Vec<P>, work: impl Fn(P) -> T + Sync) -> Vec<T> {
        let Some(helpers) = &self.helpers else { return parts.into_iter().map(work).collect() };
        let call = self.calls.fetch_add(1, Relaxed).wrapping_add(1);
        let (num_parts, num_threads) = (parts.len(), self.num_threads());
        let open: Vec<_> = parts.into_iter().map(|part| Mutex::new(Some(part))).collect();
        let done: Vec<_> = open.iter().map(|_| OnceLock::new()).collect();
        let work_from = |first: usize| {
            for part in (first..num_parts).chain(0..first) {
                let taken = open[part].lock().unwrap_or_else(PoisonError::into_inner).take();
                if let Some(taken) = taken {
                    // INVARIANT: `done[part]` is still empty, since no other thread takes this part.
                    let _ = done[part].set(work(taken));
                }
            }
        };
        let num_working = AtomicUsize::new(num_threads - 1);
        helpers.in_place_scope(|scope| {
            let (work_from, num_working) = (&work_from, &num_working);
            for helper in 1..num_threads {
                scope.spawn(move |_| {
                    work_from(helper * num_parts / num_threads);
                    num_working.fetch_sub(1, Release);
                });
            }
            work_from(0);
            spin_until(|| num_working.load(Acquire) == 0);
        });
        for _ in 1..num_threads {
            let calls = Arc::clone(&self.calls);
            helpers.spawn(move || linger(|| calls.load(Relaxed) != call));
        }
        // INVARIANT: the scope ends after all parts are done.
        done.into_iter().filter_map(OnceLock::into_inner).collect()
    }
}

/// Spins until the condition holds, but only for a limited time.
fn spin_until(is_done: impl Fn() -> bool) {
    for _ in 0..MAX_SPINS {
        if is_done() {
            break;
        }
        spin_loop();
    }
    for _ in 0..FINAL_SPINS {
        spin_loop();
    }
}

/// Busy-waits for the next call, so that the thread need not be woken for it.
fn linger(has_next: impl Fn() -> bool) {
    let began = Instant::now();
    while !has_next() && began.elapsed() < LINGER {
        spin_loop();
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Barrier;
    use std::thread;

    use super::{Team, suited_threads};

    #[test]
    fn small_batches_get_one_thread() {
        assert_eq!(suited_threads(32, 8, 1452), 1);
        assert_eq!(suited_threads(1, 10_000, 1452), 1);
        assert!(suited_threads(64, 64, 1452) <= suited_threads(1000, 64, 1452));
        let num_cores = thread::available_parallelism().map_or(1, usize::from);
        assert_eq!(
            suited_threads(usize::MAX, usize::MAX, usize::MAX),
            num_cores.min(pogema_core::MAX_THREADS)
        );
    }

    #[test]
    fn results_are_in_order_and_each_part_is_done_once() {
        for num_threads in [1, 2, 3, 8] {
            let team = Team::new(num_threads).unwrap();
            assert_eq!(team.num_threads(), num_threads);
            for num_parts in [0, 1, 2, 7, 100] {
                let mut flags = vec![0; num_parts];
                let numbers = team.share(flags.iter_mut().enumerate().collect(), |(part, flag)| {
                    *flag += 1;
                    part
                });
                assert_eq!(numbers, (0..num_parts).collect::<Vec<_>>());
                assert!(flags.iter().all(|&times| times == 1));
            }
        }
    }

    #[test]
    fn all_threads_work_concurrently_and_the_caller_is_one_of_them() {
        let team = Team::new(3).unwrap();
        let all_here = Barrier::new(3);
        let mut threads = team.share(vec![(); 3], |()| {
            all_here.wait();
            format!("{:?}", thread::current().id())
        });
        assert!(threads.contains(&format!("{:?}", thread::current().id())));
        threads.sort();
        threads.dedup();
        assert_eq!(threads.len(), 3);
    }

    #[test]
    fn the_caller_waits_for_slow_helpers() {
        let team = Team::new(2).unwrap();
        let here = thread::current().id();
        let both_here = Barrier::new(2);
        let slept = team.share(vec![(); 2], |()| {
            both_here.wait();
            let is_helper = thread::current().id() != here;
            if is_helper {
                thread::sleep(std::time::Duration::from_millis(20));
            }
            is_helper
        });
        assert_eq!(slept.iter().filter(|&&helper| helper).count(), 1);
    }
}
