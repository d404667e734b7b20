//! Measures calls per second.

use std::hint::black_box;
use std::time::{Duration, Instant};

use rayon::ThreadPool;
use rayon::prelude::*;

/// The number of intervals. The fastest one counts, because other load on the machine can only slow an interval down.
const INTERVALS: u32 = 5;

/// Returns the calls of `work` per second, in the fastest interval.
pub fn calls_per_second(budget: Duration, mut work: impl FnMut()) -> f64 {
    work();
    let interval = budget / INTERVALS;
    let mut best = 0f64;
    for _ in 0..INTERVALS {
        let (mut num_calls, mut batch) = (0u64, 1u64);
        let start = Instant::now();
        loop {
            for _ in 0..batch {
                work();
            }
            num_calls += batch;
            let spent = start.elapsed();
            if spent >= interval {
                best = best.max(num_calls as f64 / spent.as_secs_f64());
                break;
            }
            // Batches grow, so that reading the clock takes negligible time.
            batch = (2 * batch).min(1 + num_calls / 4);
        }
    }
    best
}

/// Returns how many times per second a buffer can be filled with zeros, an upper bound for writing observations.
pub fn fills_per_second<T>(budget: Duration, pool: Option<&ThreadPool>, out: &mut [T]) -> f64
where
    T: Copy + Default + Send,
{
    let Some(pool) = pool else { return calls_per_second(budget, || out.fill(black_box(T::default()))) };
    let part = out.len().div_ceil(pool.current_num_threads());
    calls_per_second(budget, || {
        pool.install(|| out.par_chunks_mut(part).for_each(|part| part.fill(black_box(T::default()))));
    })
}
