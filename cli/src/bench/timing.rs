//! Timing.

use std::hint::black_box;
use std::time::{Duration, Instant};

use rayon::ThreadPool;
use rayon::prelude::*;

/// Of so many stretches of time the fastest counts, since whatever else the machine does only ever slows it down.
const STRETCHES: u32 = 5;

/// Calls of some work per second.
pub fn calls_per_second(budget: Duration, mut work: impl FnMut()) -> f64 {
    work();
    let stretch = budget / STRETCHES;
    let mut best = 0f64;
    for _ in 0..STRETCHES {
        let (mut num_calls, mut batch) = (0u32, 1u32);
        let start = Instant::now();
        loop {
            for _ in 0..batch {
                work();
            }
            num_calls += batch;
            let spent = start.elapsed();
            if spent >= stretch {
                best = best.max(f64::from(num_calls) / spent.as_secs_f64());
                break;
            }
            // Looking at the clock must cost nothing beside the work.
            batch = (2 * batch).min(1 + num_calls / 4);
        }
    }
    best
}

/// Times the filling of a buffer with zeros, the least that writing observations can cost; calls per second.
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
