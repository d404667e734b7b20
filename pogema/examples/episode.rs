//! Plays one episode with fixed actions and prints its metrics.

use pogema::{Action, Error, GridConfig};

pub(crate) fn main() -> Result<(), Error> {
    let config = GridConfig::from_yaml("{size: 16, num_agents: 8, seed: 1, on_target: nothing}")?;
    let mut episode = pogema::start(&config)?;
    for step in 0.. {
        let actions: Vec<Action> =
            (0..config.num_agents).map(|agent| Action::ALL[(step + 3 * agent) % 5]).collect();
        episode.step(&actions)?;
        if episode.is_over() {
            break;
        }
    }
    for (name, value) in episode.metrics().named() {
        println!("{name}: {value}");
    }
    Ok(())
}
