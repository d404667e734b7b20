//! Round trips: traces and maps that are written and read back stay the same.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pogema_core::{
    Action, Cell, Collision, Config, GoalStream, Instance, Map, Metrics, Observation, Observed, ObservedMapf,
    ObservedPomapf, Occupancy, OnGoal, Outside, Padded, Reward, Snapshot, Trace, TraceHeader, TraceStart,
    TraceStep, Words,
};
use proptest::collection::vec;
use proptest::option::of;
use proptest::prelude::*;
use proptest::sample::{select, subsequence};

const LONGEST: usize = 6;

fn map(height: usize, width: usize) -> impl Strategy<Value = Map> {
    vec(any::<bool>(), height * width).prop_map(move |cells| Map::new(height, width, cells).unwrap())
}

fn any_map() -> impl Strategy<Value = Map> {
    (1..=LONGEST, 1..=LONGEST).prop_flat_map(|(height, width)| map(height, width))
}

fn any_cell() -> impl Strategy<Value = Cell> {
    any::<(u16, u16)>().prop_map(|(row, col)| Cell::new(row, col))
}

fn finite() -> impl Strategy<Value = f64> {
    any::<f64>().prop_filter("JSON has finite numbers only", |number| number.is_finite())
}

fn config(num_agents: usize) -> impl Strategy<Value = Config> {
    let collision = select(Collision::all().collect::<Vec<_>>());
    let on_goal = select(OnGoal::all().collect::<Vec<_>>());
    let observation = select(&[Observation::Default, Observation::Pomapf, Observation::Mapf][..]);
    let extensions = (any::<bool>(), any::<bool>(), any::<bool>());
    let numbers = (1..=Config::LARGEST_RADIUS, any::<i64>());
    (numbers, collision, on_goal, observation, extensions).prop_map(
        move |(numbers, collision, on_goal, observation, extensions)| {
            let (radius, max_steps) = numbers;
            let (is_exact, is_shared, persistent) = extensions;
            let occupancy = if is_exact { Occupancy::Exact } else { Occupancy::AsReleased };
            let reward = if is_shared { Reward::Shared } else { Reward::Own };
            Config {
                num_agents,
                radius,
                max_steps,
                collision,
                on_goal,
                observation,
                occupancy,
                reward,
                persistent,
            }
        },
    )
}

/// Generates headers with explicit sequences of goals, so that the header lists all of them.
fn header() -> impl Strategy<Value = TraceHeader> {
    any_map().prop_flat_map(|map| {
        let cells: Vec<Cell> = (0..map.obstacles().len()).map(|at| map.cell_at(at)).collect();
        let starts = subsequence(cells.clone(), 1..=cells.len()).prop_shuffle();
        (Just(map), starts, Just(cells)).prop_flat_map(|(map, starts, cells)| {
            let goals = vec(vec(select(cells), 1..4), starts.len());
            let noise = of(vec(any::<bool>(), 1..40));
            let config = config(starts.len());
            (Just(map), Just(starts), goals, noise, config, 0..4_usize).prop_map(|parts| {
                let (map, starts, goals, noise, config, num_goals) = parts;
                let outside = noise.map_or(Outside::Free, |flags| {
                    let [height, width] = [map.height(), map.width()].map(|side| side + 2 * config.radius);
                    let obstacles = flags.into_iter().cycle().take(height * width).collect();
                    Outside::Noise(Map::new(height, width, obstacles).unwrap())
                });
                let stream = |goals: Vec<Cell>| GoalStream::sequence(goals[0], goals.into());
                let goals = goals.into_iter().map(stream).collect();
                TraceHeader::new(config, &Instance::new(map, outside, starts, goals).unwrap(), num_goals)
            })
        })
    })
}

fn state(num_agents: usize) -> impl Strategy<Value = Snapshot> {
    let cells = || vec(any_cell(), num_agents);
    let flags = || vec(any::<bool>(), num_agents);
    (cells(), cells(), flags(), flags(), vec(any_cell(), 0..4)).prop_map(
        |(cells, goals, active, on_goal, occupied)| Snapshot { cells, goals, active, on_goal, occupied },
    )
}

fn observed(num_agents: usize) -> impl Strategy<Value = Observed> {
    let windows = || vec("[0-9a-f]{0,8}", num_agents);
    let pairs = || vec(any::<[i32; 2]>(), num_agents);
    let odd = || vec("\\PC*", 0..2);
    let pomapf = move || {
        ("[a-z0-9]*", windows(), windows(), pairs(), pairs(), odd()).prop_map(
            |(dtype, obstacles, agents, xy, target_xy, odd)| ObservedPomapf {
                dtype,
                obstacles,
                agents,
                xy,
                target_xy,
                odd,
            },
        )
    };
    let padded = of(("[a-z0-9]*", vec("[.#]{0,3}", 0..3)).prop_map(|(dtype, rows)| Padded { dtype, rows }));
    let mapf = (pomapf(), padded, pairs(), pairs()).prop_map(
        |(pomapf, global_obstacles, global_xy, global_target_xy)| {
            Observed::Mapf(ObservedMapf { pomapf, global_obstacles, global_xy, global_target_xy })
        },
    );
    let default = ("[a-z0-9]*", windows(), odd()).prop_map(|(dtype, windows, odd)| Observed::Default {
        dtype,
        windows,
        odd,
    });
    prop_oneof![default, pomapf().prop_map(Observed::Pomapf), mapf]
}

fn metrics() -> impl Strategy<Value = Metrics> {
    (of(finite()), of(finite()), of(finite()), of(finite())).prop_map(
        |(isr, soc, avg_throughput, a_collisions)| Metrics {
            isr,
            soc,
            avg_throughput,
            a_collisions,
            ..Metrics::default()
        },
    )
}

fn step(num_agents: usize) -> impl Strategy<Value = TraceStep> {
    let rewards = vec(
        any::<f32>().prop_filter("JSON has finite numbers only", |reward| reward.is_finite()),
        num_agents,
    );
    let flags = || vec(any::<bool>(), num_agents);
    let lists = (vec(select(&Action::ALL[..]), num_agents), rewards, flags(), flags());
    (lists, state(num_agents), of(observed(num_agents)), of(metrics())).prop_map(
        |((actions, rewards, terminated, truncated), state, observations, metrics)| TraceStep {
            actions,
            state,
            rewards,
            terminated,
            truncated,
            observations,
            metrics,
        },
    )
}

fn trace() -> impl Strategy<Value = Trace> {
    header().prop_flat_map(|header| {
        let num_agents = header.starts.len();
        let steps = vec(step(num_agents), 0..4);
        (Just(header), state(num_agents), of(observed(num_agents)), steps).prop_map(|parts| {
            let (header, state, observations, steps) = parts;
            Trace { header, start: TraceStart { state, observations }, steps }
        })
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(500) })]

    #[test]
    fn a_written_trace_is_read_back_unchanged(trace in trace()) {
        let mut text = Vec::new();
        trace.write(&mut text).unwrap();
        prop_assert_eq!(text.split_inclusive(|&byte| byte == b'\n').count(), 3 + trace.steps.len());
        prop_assert_eq!(Trace::read(&text[..]).unwrap(), trace);
    }

    #[test]
    fn a_map_equals_the_map_of_its_rows(map in any_map()) {
        let rows = map.rows();
        prop_assert_eq!((rows.len(), rows[0].len()), (map.height(), map.width()));
        prop_assert_eq!(Map::from_rows(&rows).unwrap(), map);
    }

    #[test]
    fn rows_are_read_unchanged_or_rejected_with_an_error_on_one_line(rows in vec("[.#]{0,4}|\\PC{0,4}", 0..4)) {
        match Map::from_rows(&rows) {
            Ok(map) => prop_assert_eq!(map.rows(), rows),
            Err(error) => prop_assert!(!error.to_string().chars().any(char::is_control), "{}", error),
        }
    }
}
