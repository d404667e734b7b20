//! The drawn border is the one that agents see.

use pogema_core::Environment;
use pogema_reference::Reference;
use pogema_render::{Border, Ground};

use crate::common::{Policy, config, trace};

#[test]
fn the_full_border_matches_the_engine() {
    for outside in ["true", "false"] {
        for radius in [1, 2, 5] {
            let text = format!(
                "{{size: 7, num_agents: 2, seed: 4, density: 0.4, obs_radius: {radius}, empty_outside: {outside}, observation_type: MAPF}}"
            );
            let trace = trace(&config(&text), Policy::Random);
            let mut environment = Reference::new(trace.header.config).unwrap();
            environment.reset(&trace.header.instance().unwrap()).unwrap();
            let side = 7 + 2 * radius;
            let mut obstacles = vec![0; side * side];
            environment.observe_map(&mut obstacles).unwrap();

            let ground = Ground::of(&trace);
            let (rows, cols) = (ground.rows(Border::Full), ground.cols(Border::Full));
            let drawn: Vec<u8> = rows
                .flat_map(|row| cols.clone().map(move |col| u8::from(ground.is_obstacle(row, col))))
                .collect();
            assert_eq!(drawn, obstacles, "{text}");
        }
    }
}
