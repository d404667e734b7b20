//! Prints the number of inputs that a network processes per second on one thread: `forwards FILE BATCH`.
//! `benches/peers/networks.py` runs it.

use std::sync::LazyLock;
use std::time::{Duration, Instant};

use pogema_policies::{Inputs, Network, RecurrentState};

/// Number of measurements. The fastest one counts.
const NUM_MEASUREMENTS: usize = 60;

/// Least duration of a measurement.
const MIN_TIME: Duration = Duration::from_millis(4);

/// Returns the CPU time of this thread, because other processes may use the processor.
///
/// Without `/proc/thread-self/schedstat`, it returns the time since its first call.
fn now() -> Duration {
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let running = text.split(' ').next().and_then(|nanoseconds| nanoseconds.parse().ok());
    running.map_or_else(|| START.elapsed(), Duration::from_nanos)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, batch] = &*arguments else {
        return Err(format!("found {} arguments, expected 2: FILE BATCH", arguments.len()).into());
    };
    let (network, batch) = (Network::read(file)?, batch.parse::<usize>()?);
    // The values -1, 0 and 1, as in a window.
    let num_values = batch * network.input_shape().iter().product::<usize>();
    let windows: Vec<f32> = (0..num_values).map(|index| (index * 7919 % 3) as f32 - 1.0).collect();
    let scalars = vec![0.5; batch * network.num_scalars()];
    let inputs = Inputs { windows: &windows, scalars: &scalars, batch };
    let (mut state, mut workspace) = (RecurrentState::new(&network, batch), network.workspace());
    // Each reading of the clock covers at least 256 inputs, so that its own time does not matter.
    let repeats = 256_usize.div_ceil(batch);
    let mut best = f64::MAX;
    for _ in 0..NUM_MEASUREMENTS {
        let (start, mut count) = (now(), 0);
        while now().saturating_sub(start) < MIN_TIME {
            for _ in 0..repeats {
                network.forward(inputs, &mut state, &mut workspace)?;
            }
            count += repeats * batch;
        }
        best = best.min(now().saturating_sub(start).as_secs_f64() / count as f64);
    }
    println!("{}", 1.0 / best);
    Ok(())
}
