//! Compares encoders with engines, and with plain code, in random episodes.

use std::collections::{BTreeMap, HashSet, VecDeque};
use std::sync::atomic::AtomicBool;

use pogema_core::{Cell, Config, Environment, Episode, Error, Map, State};
use pogema_fast::Engine;
use pogema_numpy::Generator;
use pogema_policies::{Channel, Encoder, EncoderSettings, Scalars};
use proptest::prelude::*;

use crate::common;

/// A place relative to the map, which may lie outside it.
type Place = (i32, i32);

fn place(cell: Cell) -> Place {
    (i32::from(cell.row), i32::from(cell.col))
}

fn is_free(map: &Map, place: Place) -> bool {
    Cell::checked(place).is_some_and(|cell| !map.is_obstacle(cell))
}

fn around((row, col): Place) -> [Place; 4] {
    [(row - 1, col), (row + 1, col), (row, col - 1), (row, col + 1)]
}

fn window((row, col): Place, radius: i32) -> impl Iterator<Item = Place> {
    (row - radius..=row + radius)
        .flat_map(move |row| (col - radius..=col + radius).map(move |col| (row, col)))
}

fn distances(map: &Map, goal: Place) -> BTreeMap<Place, i32> {
    let (mut known, mut queue) = (BTreeMap::new(), VecDeque::new());
    if is_free(map, goal) {
        known.insert(goal, 0);
        queue.push_back(goal);
    }
    while let Some(from) = queue.pop_front() {
        for next in around(from).into_iter().filter(|&next| is_free(map, next)) {
            if !known.contains_key(&next) {
                known.insert(next, known[&from] + 1);
                queue.push_back(next);
            }
        }
    }
    known
}

/// The memory of the plain code.
#[derive(Default)]
struct Plain {
    best: Vec<Option<(Cell, i32)>>,
    seen: Vec<HashSet<Place>>,
}

impl Plain {
    /// Computes the windows of an agent as the documentation of their channels defines them.
    fn windows(
        &mut self,
        agent: usize,
        episode: &Episode<Engine>,
        settings: &EncoderSettings,
    ) -> Result<Vec<f32>, Error> {
        let (state, map) = (episode.state(), episode.instance()?.map());
        let (at, goal) = (place(state.cells[agent]), place(state.goals[agent]));
        let costs = distances(map, goal);
        let now = costs.get(&at).copied();
        let known = self.best[agent].filter(|known| known.0 == state.goals[agent]).map(|known| known.1);
        let best = known.into_iter().chain(now).min();
        self.best[agent] = best.map(|best| (state.goals[agent], best));
        let radius = settings.radius as i32;
        let bordered = Bordered::of(episode)?;
        if state.active[agent] {
            let seen = window(at, settings.sight as i32).filter(|&place| bordered.is_obstacle(place));
            self.seen[agent].extend(seen);
        }
        let places: Vec<Place> = window(at, radius).collect();
        let mut out = Vec::new();
        for channel in &settings.channels {
            let values: Vec<f32> = match channel {
                _ if !state.active[agent] => vec![0.0; places.len()],
                Channel::AllAgents => flags(&places, |place| is_occupied(state, place)),
                Channel::CostToGo => {
                    places.iter().map(|place| cost_to_go(now, costs.get(place), radius)).collect()
                }
                Channel::CostTracer => tracer(&places, &costs, now, best),
                Channel::Path => {
                    let path = path(&costs, at, radius);
                    flags(&places, |place| path.contains(&place))
                }
                Channel::SeenObstacles => flags(&places, |place| self.seen[agent].contains(&place)),
                Channel::Obstacles
                | Channel::Agents
                | Channel::SeenAgents
                | Channel::Goal
                | Channel::FollowerPath => Vec::new(),
            };
            out.extend(values);
        }
        Ok(out)
    }
}

fn flags(places: &[Place], is_set: impl Fn(Place) -> bool) -> Vec<f32> {
    places.iter().map(|&place| f32::from(u8::from(is_set(place)))).collect()
}

fn is_occupied(state: State<'_>, at: Place) -> bool {
    (0..state.cells.len()).any(|agent| state.active[agent] && place(state.cells[agent]) == at)
}

fn cost_to_go(now: Option<i32>, cost: Option<&i32>, radius: i32) -> f32 {
    let (Some(now), Some(cost)) = (now, cost) else { return -1.0 };
    ((now - cost) as f32 / (2 * radius) as f32).clamp(-1.0, 1.0)
}

fn tracer(places: &[Place], costs: &BTreeMap<Place, i32>, now: Option<i32>, best: Option<i32>) -> Vec<f32> {
    let mut values = vec![0.0; places.len()];
    let centre = places.len() / 2;
    let (Some(now), Some(best)) = (now, best) else {
        values[centre] = -1.0;
        return values;
    };
    let largest = places.iter().filter_map(|place| costs.get(place)).max().copied().unwrap_or_default();
    let filled: Vec<i32> =
        places.iter().map(|place| costs.get(place).copied().unwrap_or(largest + 4)).collect();
    let smallest = filled.iter().min().copied().unwrap_or_default();
    let lowered: Vec<f32> = filled.iter().map(|cost| (cost - smallest) as f32).collect();
    let most = lowered.iter().copied().fold(0.0, f32::max);
    for (value, x) in values.iter_mut().zip(lowered) {
        *value = (most - x) / most;
    }
    values[centre] = -f32::min(1.0, (now - best + 1) as f32 / 64.0);
    values
}

fn path(costs: &BTreeMap<Place, i32>, start: Place, radius: i32) -> HashSet<Place> {
    let (mut drawn, mut at) = (HashSet::new(), start);
    while costs.contains_key(&at) && (at.0 - start.0).abs().max((at.1 - start.1).abs()) <= radius {
        drawn.insert(at);
        let nearer = |next: &Place| costs.get(next).is_some_and(|&cost| cost == costs[&at] - 1);
        match around(at).into_iter().find(nearer) {
            Some(next) => at = next,
            None => break,
        }
    }
    drawn
}

/// The map with its border, as the engine shows it.
struct Bordered {
    cells: Vec<u8>,
    width: i32,
    radius: i32,
}

impl Bordered {
    fn of(episode: &Episode<Engine>) -> Result<Self, Error> {
        let (map, radius) = (episode.instance()?.map(), episode.config().radius);
        let (height, width) = (map.height() + 2 * radius, map.width() + 2 * radius);
        let mut cells = vec![0; height * width];
        episode.engine().observe_map(&mut cells)?;
        Ok(Self { cells, width: width as i32, radius: radius as i32 })
    }

    fn is_obstacle(&self, (row, col): Place) -> bool {
        let (row, col) = (row + self.radius, col + self.radius);
        let index = usize::try_from(row * self.width + col);
        let inside = row >= 0 && (0..self.width).contains(&col);
        inside && index.is_ok_and(|index| self.cells.get(index) == Some(&1))
    }
}

/// The channels that engines show, too.
const OBSERVED: [Channel; 3] = [Channel::Obstacles, Channel::Agents, Channel::Goal];

/// The channels of the plain code.
const COMPUTED: [Channel; 5] =
    [Channel::AllAgents, Channel::CostToGo, Channel::CostTracer, Channel::Path, Channel::SeenObstacles];

fn begin(settings: EncoderSettings, episode: &Episode<Engine>) -> Result<Encoder, Error> {
    let (instance, mut encoder) = (episode.instance()?, Encoder::new(settings)?);
    let Config { occupancy, .. } = *episode.config();
    encoder.begin(instance.map(), instance.outside(), occupancy, instance.starts());
    Ok(encoder)
}

fn scalars(state: State<'_>, starts: &[Cell]) -> Vec<f32> {
    let of_agent = |agent: usize| {
        let (start, cell, goal) =
            (place(starts[agent]), place(state.cells[agent]), place(state.goals[agent]));
        let minus = |to: Place, from: Place| [to.0 - from.0, to.1 - from.1];
        let scaled = |offset: [i32; 2]| offset.map(|x| x as f32 / x.abs().max(64) as f32);
        let [rows, cols] = minus(goal, cell);
        let length = if (rows, cols) == (0, 0) { 1.0 } else { ((rows * rows + cols * cols) as f32).sqrt() };
        let direction = [rows as f32 / length, cols as f32 / length];
        let all =
            [scaled(minus(cell, start)), scaled(minus(goal, start)), scaled(minus(goal, cell)), direction];
        all.as_flattened()
            .iter()
            .map(|&value| if state.active[agent] { value } else { 0.0 })
            .collect::<Vec<_>>()
    };
    (0..starts.len()).flat_map(of_agent).collect()
}

fn check(yaml: &str, radius: usize, seed: u64) -> Result<(), TestCaseError> {
    // Some drawn maps have no room for the agents.
    let Ok(mut episode) = common::start(yaml) else { return Err(TestCaseError::reject("no instance")) };
    let num_agents = episode.config().num_agents;
    let observed = EncoderSettings::new(episode.config().radius, OBSERVED);
    let computed = EncoderSettings {
        scalars: vec![Scalars::Position, Scalars::GoalPosition, Scalars::GoalOffset, Scalars::GoalDirection],
        sight: episode.config().radius,
        ..EncoderSettings::new(radius, COMPUTED)
    };
    let mut encoders = [&observed, &computed].map(|settings| begin(settings.clone(), &episode).unwrap());
    let mut slow = Plain { best: vec![None; num_agents], seen: vec![HashSet::new(); num_agents] };
    let mut generator = Generator::seeded(seed);
    loop {
        let mut shown = vec![f32::NAN; episode.config().num_observed()];
        let mut expected = shown.clone();
        encoders[0].encode(episode.state(), &mut shown, &mut []).unwrap();
        episode.engine().observe(&mut expected).unwrap();
        for (agent, (seen, expected)) in
            shown.chunks(observed.window_len()).zip(expected.chunks(observed.window_len())).enumerate()
        {
            // The engine shows obstacles to an inactive agent; the encoder shows nothing.
            let zeros = vec![0.0; seen.len()];
            let expected = if episode.state().active[agent] { expected } else { &zeros };
            prop_assert_eq!(seen, expected, "agent {} in step {}", agent, episode.num_steps());
        }
        let mut windows = vec![f32::NAN; num_agents * computed.window_len()];
        let mut numbers = vec![f32::NAN; num_agents * computed.scalars_len()];
        encoders[1].encode(episode.state(), &mut windows, &mut numbers).unwrap();
        prop_assert_eq!(numbers, scalars(episode.state(), episode.instance().unwrap().starts()));
        for (agent, windows) in windows.chunks(computed.window_len()).enumerate() {
            let expected = slow.windows(agent, &episode, &computed).unwrap();
            prop_assert_eq!(windows, expected, "agent {} in step {}", agent, episode.num_steps());
        }
        if episode.is_over() {
            return Ok(());
        }
        episode.step(&common::actions(&mut generator, num_agents)).unwrap();
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn encoders_equal_engines_and_plain_code(
        seed in 0_u64..1000,
        size in 3_usize..12,
        density in 0.0..0.5_f64,
        share in 0.1..0.6_f64,
        radius in 1_usize..7,
        sight in 1_usize..7,
        collision in prop::sample::select(&["soft", "priority", "block_both"][..]),
        on_goal in prop::sample::select(&["restart", "finish", "nothing"][..]),
        outside in any::<bool>(),
    ) {
        let free = (size * size) as f64 * (1.0 - density) * 0.5;
        let num_agents = ((free * share) as usize).max(1);
        let yaml = format!(
            "{{size: {size}, density: {density}, num_agents: {num_agents}, seed: {seed}, obs_radius: {sight}, \
             collision_system: {collision}, on_target: {on_goal}, max_episode_steps: 24, empty_outside: {outside}}}"
        );
        check(&yaml, radius, seed)?;
    }
}

#[test]
fn memories_grow() {
    let row = ".".repeat(84) + "#";
    let yaml = format!(
        "{{map: '{row}', num_agents: 1, seed: 0, agents_xy: [[0, 0]], targets_xy: [[0, 83]], obs_radius: 2, \
         on_target: nothing, max_episode_steps: 90}}"
    );
    let mut episode = common::start(&yaml).unwrap();
    let settings = EncoderSettings { sight: 2, ..EncoderSettings::new(7, [Channel::SeenObstacles]) };
    let mut encoder = begin(settings, &episode).unwrap();
    let mut seen = [f32::NAN; 225];
    for step in 0..=82 {
        encoder.encode(episode.state(), &mut seen, &mut []).unwrap();
        let places: Vec<Place> = window((0, step), 7).collect();
        let expected = flags(&places, |(row, col)| {
            let is_wall = (-1..=1).contains(&row) && (-1..=85).contains(&col);
            let is_free = row == 0 && (0..84).contains(&col);
            col <= step + 2 && is_wall && !is_free
        });
        assert_eq!(seen[..], expected, "step {step}");
        episode.step(&[pogema_core::Action::Right]).unwrap();
    }
}

#[test]
fn seen_agents_are_the_agents_within_sight() {
    let yaml = "{size: 9, density: 0.1, num_agents: 30, seed: 3, collision_system: soft, on_target: restart}";
    for (radius, sight) in [(4, 2), (2, 4), (3, 3)] {
        let mut episode = common::start(yaml).unwrap();
        let settings =
            EncoderSettings { sight, ..EncoderSettings::new(radius, [Channel::Agents, Channel::SeenAgents]) };
        let area = settings.side() * settings.side();
        let mut windows = vec![0.0; 30 * settings.window_len()];
        let mut encoder = begin(settings, &episode).unwrap();
        let mut generator = Generator::seeded(0);
        for _ in 0..8 {
            encoder.encode(episode.state(), &mut windows, &mut []).unwrap();
            for of_agent in windows.chunks_exact(2 * area) {
                let (agents, seen) = of_agent.split_at(area);
                for ((row, col), (agent, seen)) in window((0, 0), radius as i32).zip(agents.iter().zip(seen))
                {
                    let is_seen = row.abs().max(col.abs()) <= sight as i32;
                    assert_eq!(*seen, if is_seen { *agent } else { 0.0 }, "({row}, {col})");
                }
            }
            episode.step(&pogema_planners::sample(&mut generator, 30)).unwrap();
        }
    }
}

#[test]
fn an_encoder_starts_anew_after_a_gap_and_in_a_new_episode() {
    let yaml = "{size: 6, density: 0.1, num_agents: 12, seed: 3, collision_system: soft, on_target: restart}";
    let mut episode = common::start(yaml).unwrap();
    let settings = EncoderSettings::new(5, [Channel::Agents, Channel::AllAgents, Channel::CostTracer]);
    let mut encoder = begin(settings.clone(), &episode).unwrap();
    let mut generator = Generator::seeded(0);
    let (mut first, mut again) = (vec![0.0; 12 * 363], vec![0.0; 12 * 363]);
    let mut num_lost = 0;
    for _ in 0..40 {
        encoder.encode(episode.state(), &mut first, &mut []).unwrap();
        num_lost += usize::from(first.chunks(363).any(|window| window[..121] != window[121..242]));
        episode.step(&common::actions(&mut generator, 12)).unwrap();
    }
    assert!(num_lost > 0, "no mark was lost, so the test shows nothing");
    // A gap: the encoder misses a state, so it rebuilds all marks, which are then exact.
    episode.step(&common::actions(&mut generator, 12)).unwrap();
    encoder.encode(episode.state(), &mut first, &mut []).unwrap();
    assert!(first.chunks(363).all(|window| window[..121] == window[121..242]));
    // A new episode on another map.
    let other = common::start(&yaml.replace("seed: 3", "seed: 4")).unwrap();
    let mut fresh = begin(settings, &other).unwrap();
    let instance = other.instance().unwrap();
    encoder.begin(instance.map(), instance.outside(), other.config().occupancy, instance.starts());
    encoder.encode(other.state(), &mut first, &mut []).unwrap();
    fresh.encode(other.state(), &mut again, &mut []).unwrap();
    assert_eq!(first, again);
}

/// Every channel.
const ALL: [Channel; 10] = [
    Channel::Obstacles,
    Channel::Agents,
    Channel::AllAgents,
    Channel::Goal,
    Channel::CostToGo,
    Channel::CostTracer,
    Channel::Path,
    Channel::FollowerPath,
    Channel::SeenAgents,
    Channel::SeenObstacles,
];

#[test]
fn a_new_episode_on_the_same_map_forgets_the_last_one() {
    let yaml = "{size: 7, density: 0.2, num_agents: 8, seed: 3, collision_system: soft, on_target: restart}";
    let mut episode = common::start(yaml).unwrap();
    let settings = EncoderSettings { sight: 2, ..EncoderSettings::new(3, ALL) };
    let mut used = begin(settings.clone(), &episode).unwrap().with_cache_bytes(1 << 10);
    let mut generator = Generator::seeded(0);
    let mut windows = [(); 2].map(|()| vec![f32::NAN; 8 * settings.window_len()]);
    for _ in 0..3 {
        episode = common::start(yaml).unwrap();
        let mut fresh = begin(settings.clone(), &episode).unwrap();
        let instance = episode.instance().unwrap();
        used.begin(instance.map(), instance.outside(), episode.config().occupancy, instance.starts());
        for _ in 0..20 {
            used.follow(episode.state()).unwrap();
            fresh.encode(episode.state(), &mut windows[1], &mut []).unwrap();
            // The windows may be written any number of times.
            for _ in 0..2 {
                windows[0].fill(f32::NAN);
                used.write(episode.state(), &mut windows[0], &mut []).unwrap();
                assert_eq!(windows[0], windows[1], "step {}", episode.num_steps());
            }
            episode.step(&common::actions(&mut generator, 8)).unwrap();
        }
    }
}

#[test]
fn following_can_be_stopped() {
    let episode = common::start("{size: 7, num_agents: 4, seed: 3}").unwrap();
    for channel in [Channel::CostToGo, Channel::FollowerPath] {
        let settings = EncoderSettings::new(3, [channel]);
        let mut encoder = begin(settings.clone(), &episode).unwrap();
        let stopped = encoder.follow_until(episode.state(), &AtomicBool::new(true));
        assert_eq!(stopped, Err(Error::Cancelled));
        let instance = episode.instance().unwrap();
        encoder.begin(instance.map(), instance.outside(), episode.config().occupancy, instance.starts());
        let mut windows = vec![f32::NAN; 4 * settings.window_len()];
        encoder.encode(episode.state(), &mut windows, &mut []).unwrap();
        assert!(windows.iter().all(|value| value.is_finite()));
    }
}
