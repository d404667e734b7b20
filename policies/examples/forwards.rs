//! Prints how many forward passes a second one thread makes: `forwards FILE BATCH`. The peers' benchmark runs it.

use std::sync::LazyLock;
use std::time::{Duration, Instant};

use pogema_policies::{Inputs, Network, RecurrentState};

/// Number of times that are taken. The shortest counts.
const TIMES: usize = 60;

/// The least time that is measured at once.
const TIME: Duration = Duration::from_millis(4);

/// Returns the time that this thread has run, since the machine may do other work; on systems other than Linux, the time
/// since the start.
fn now() -> Duration {
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let running = text.split(' ').next().and_then(|nanoseconds| nanoseconds.parse().ok());
    running.map_or_else(|| START.elapsed(), Duration::from_nanos)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, batch] = &*arguments else { return Err("expected FILE BATCH".into()) };
    let (network, batch) = (Network::read(file)?, batch.parse::<usize>()?);
    // Values from -1 to 1, as those of a window.
    let num_values = batch * network.input_shape().iter().product::<usize>();
    let windows: Vec<f32> = (0..num_values).map(|index| (index * 7919 % 3) as f32 - 1.0).collect();
    let scalars = vec![0.5; batch * network.num_scalars()];
    let inputs = Inputs { windows: &windows, scalars: &scalars, batch };
    let (mut state, mut workspace) = (RecurrentState::new(&network, batch), network.workspace());
    // Taking the time must not count.
    let repeats = 256_usize.div_ceil(batch);
    let mut best = f64::MAX;
    for _ in 0..TIMES {
        let (start, mut count) = (now(), 0);
        while now().saturating_sub(start) < TIME {
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
