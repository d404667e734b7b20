//! Random requests that vary the config fields; most instances are small and crowded.

use pogema_core::{Occupancy, Reward, Words as _};
use pogema_maps::{GridConfig, InstanceSource};
use serde_json::{Map as Object, Value, json};

use crate::dice::Dice;
use crate::request::{Registered, Request};

/// The form in which a case gives its map, starts and goals.
#[derive(Clone, Copy)]
enum Layout {
    Seeded,
    Text,
    Rows,
    Letters,
    PoolText,
    Pools,
    GoalPool,
    Explicit,
    Sequences,
    RandomStarts,
    Named,
}

/// Draws the config of a case with the fields of POGEMA 1.4.0; [`crate::play_script`] adds the operations.
pub fn draw_request(seed: u64, case: u64) -> Request {
    draw(&mut Dice::new(seed, case), case)
}

/// Draws like [`draw_request`], then in some cases also the fields that POGEMA 1.4.0 lacks.
///
/// All other fields have the values that [`draw_request`] draws for the same seed and case.
pub fn draw_extended_request(seed: u64, case: u64) -> Request {
    let mut dice = Dice::new(seed, case);
    let mut request = draw(&mut dice, case);
    if dice.chance(EXTENDED) {
        request.config["occupancy"] = Occupancy::Exact.word().into();
    }
    if dice.chance(EXTENDED) {
        request.config["reward"] = Reward::Shared.word().into();
    }
    request
}

/// The probability of each field that POGEMA 1.4.0 lacks.
const EXTENDED: f64 = 0.2;

fn draw(dice: &mut Dice, case: u64) -> Request {
    loop {
        let mut request = draw_once(dice);
        request.id = case;
        if try_fit(dice, &mut request) {
            return request;
        }
    }
}

/// Halves the number of agents until the case can be played, and returns whether to keep the case. Keeps a few
/// unplayable cases.
fn try_fit(dice: &mut Dice, request: &mut Request) -> bool {
    const KEPT_UNPLAYABLE: f64 = 0.005;
    let registered = request.register.as_ref().and_then(|map| pogema_core::Map::from_rows(&map.rows).ok());
    loop {
        let generated = GridConfig::from_value(&request.config)
            .and_then(|config| InstanceSource::new(config, registered.clone())?.generate());
        let Err(error) = generated else { return true };
        let num_agents = request.config.get("num_agents").and_then(Value::as_u64);
        let is_crowded = error.field() == Some("num_agents");
        match num_agents {
            Some(num) if num > 1 && is_crowded && !dice.chance(KEPT_UNPLAYABLE) => {
                request.config["num_agents"] = json!(num / 2);
            }
            // POGEMA replaces a named map that is too small with a generated one, so the case cannot be compared.
            Some(_) => return is_crowded && request.register.is_none(),
            None => return false,
        }
    }
}

fn draw_once(dice: &mut Dice) -> Request {
    let mut config = Object::new();
    let on_target = dice.pick(&["finish", "nothing", "restart"]);
    config.insert("on_target".into(), on_target.into());
    config.insert("collision_system".into(), dice.pick(&["priority", "block_both", "soft", "soft"]).into());
    config.insert("observation_type".into(), dice.pick(&["default", "default", "POMAPF", "MAPF"]).into());
    config.insert("seed".into(), draw_seed(dice).into());
    config.insert("obs_radius".into(), draw_radius(dice).into());
    let max_steps: i64 = if dice.chance(0.02) { -1 } else { dice.between(1, 24) as i64 };
    config.insert("max_episode_steps".into(), max_steps.into());
    config.insert("empty_outside".into(), dice.chance(0.7).into());
    config.insert("persistent".into(), dice.chance(0.12).into());
    let (height, width) = draw_size(dice);
    let layout = draw_layout(dice, on_target);
    let register = put_layout(dice, &mut config, layout, height, width);
    // A start on an obstacle can have a window without a free cell, where POGEMA's density divides by zero.
    let may_measure = config["observation_type"] != "default" && !config.contains_key("possible_agents_xy");
    let density = may_measure && dice.chance(0.5);
    Request { id: 0, config: Value::Object(config), register, density, collisions: false, ops: Vec::new() }
}

fn draw_seed(dice: &mut Dice) -> u64 {
    match dice.below(8) {
        0 => dice.between(0, 3) as u64,
        1 => (1 << 62) + dice.below(1 << 60) as u64,
        2 => i64::MAX as u64 - 1 - dice.below(5) as u64,
        _ => dice.below(1 << 32) as u64,
    }
}

fn draw_radius(dice: &mut Dice) -> usize {
    match dice.below(50) {
        0 => dice.between(6, 40),
        1..=10 => dice.between(4, 6),
        _ => dice.between(1, 3),
    }
}

fn draw_size(dice: &mut Dice) -> (usize, usize) {
    let max_side = dice.pick(&[2, 3, 3, 4, 4, 5, 6, 8, 10, 12, 16, 24]);
    loop {
        let (height, width) = (dice.between(1, max_side), dice.between(1, max_side));
        if height * width > 1 {
            return (height, width);
        }
    }
}

fn draw_layout(dice: &mut Dice, on_target: &str) -> Layout {
    use Layout::{
        Explicit, GoalPool, Letters, Named, PoolText, Pools, RandomStarts, Rows, Seeded, Sequences, Text,
    };
    let (num_seeded, others): (usize, &[Layout]) = if on_target == "restart" {
        (4, &[Text, Rows, PoolText, Pools, GoalPool, Sequences, RandomStarts, Named])
    } else {
        (3, &[Text, Rows, Letters, PoolText, Pools, Explicit, Explicit, Sequences, Named])
    };
    dice.pick(&[&vec![Seeded; num_seeded], others].concat())
}

/// Writes map, starts and goals into the config, and returns the map to register, if any.
fn put_layout(
    dice: &mut Dice,
    config: &mut Object<String, Value>,
    layout: Layout,
    height: usize,
    width: usize,
) -> Option<Registered> {
    let density = dice.pick(&[0.0, 0.0, 0.1, 0.2, 0.3, 0.5]);
    let obstacles = draw_obstacles(dice, height, width, density);
    let num_free = obstacles.iter().flatten().filter(|&&obstacle| !obstacle).count();
    let num_agents = dice.between(1, (num_free / 2).max(1));
    let set_num_agents =
        |config: &mut Object<String, Value>| config.insert("num_agents".into(), num_agents.into());
    match layout {
        Layout::Seeded => {
            if height == width && dice.chance(0.5) {
                config.insert("size".into(), height.into());
            } else {
                config.insert("height".into(), height.into());
                config.insert("width".into(), width.into());
            }
            config.insert("density".into(), density.into());
            set_num_agents(config);
        }
        Layout::Text => {
            config.insert("map".into(), text(&obstacles).into());
            set_num_agents(config);
        }
        Layout::Rows => {
            config.insert("map".into(), rows(&obstacles));
            set_num_agents(config);
        }
        Layout::Letters => {
            config.insert("map".into(), lettered(dice, &obstacles).into());
        }
        Layout::PoolText => {
            config.insert("map".into(), marked(dice, &obstacles).into());
            set_num_agents(config);
        }
        Layout::Named => {
            let name = "drawn-map";
            config.insert("map_name".into(), name.into());
            set_num_agents(config);
            return Some(Registered { name: name.into(), rows: lines(&obstacles) });
        }
        Layout::Pools | Layout::GoalPool | Layout::Explicit | Layout::Sequences | Layout::RandomStarts => {
            put_places(dice, config, layout, &obstacles, num_agents);
        }
    }
    None
}

/// Writes starts and goals as lists into the config, with a given or a generated map.
fn put_places(
    dice: &mut Dice,
    config: &mut Object<String, Value>,
    layout: Layout,
    obstacles: &[Vec<bool>],
    num_agents: usize,
) {
    let (height, width) = (obstacles.len(), obstacles[0].len());
    if dice.chance(0.6) {
        config.insert("map".into(), if dice.chance(0.5) { rows(obstacles) } else { text(obstacles).into() });
    } else {
        config.insert("height".into(), height.into());
        config.insert("width".into(), width.into());
        config.insert("density".into(), 0.2.into());
    }
    let mut cells: Vec<[usize; 2]> =
        (0..height).flat_map(|row| (0..width).map(move |col| [row, col])).collect();
    dice.shuffle(&mut cells);
    let any = |dice: &mut Dice| [dice.below(height), dice.below(width)];
    let num_agents = num_agents.min(cells.len());
    config.insert("num_agents".into(), num_agents.into());
    match layout {
        Layout::Pools => {
            let num_starts = dice.between(num_agents, cells.len());
            config.insert("possible_agents_xy".into(), json!(cells[..num_starts]));
            dice.shuffle(&mut cells);
            let num_goals = dice.between(num_agents, cells.len());
            config.insert("possible_targets_xy".into(), json!(cells[..num_goals]));
        }
        Layout::GoalPool => {
            config.insert("possible_targets_xy".into(), json!(cells[..dice.between(2, cells.len())]));
        }
        Layout::Explicit => {
            let goals: Vec<_> = (0..num_agents).map(|_| any(dice)).collect();
            config.insert("agents_xy".into(), json!(cells[..num_agents]));
            config.insert("targets_xy".into(), json!(goals));
            match dice.below(3) {
                0 => drop(config.remove("num_agents")),
                1 => drop(config.insert("num_agents".into(), dice.between(1, num_agents).into())),
                _ => {}
            }
        }
        _ => {
            let sequence = |dice: &mut Dice| (0..dice.between(2, 4)).map(|_| any(dice)).collect::<Vec<_>>();
            let sequences: Vec<_> = (0..num_agents).map(|_| sequence(dice)).collect();
            config.insert("targets_xy".into(), json!(sequences));
            if matches!(layout, Layout::Sequences) {
                config.insert("agents_xy".into(), json!(cells[..num_agents]));
            }
        }
    }
}

fn draw_obstacles(dice: &mut Dice, height: usize, width: usize, density: f64) -> Vec<Vec<bool>> {
    (0..height).map(|_| (0..width).map(|_| dice.chance(density)).collect()).collect()
}

fn lines(obstacles: &[Vec<bool>]) -> Vec<String> {
    let line = |row: &Vec<bool>| row.iter().map(|&obstacle| if obstacle { '#' } else { '.' }).collect();
    obstacles.iter().map(line).collect()
}

/// Writes a map as text, with `#` for obstacles.
pub(crate) fn text(obstacles: &[Vec<bool>]) -> String {
    lines(obstacles).join("\n")
}

fn rows(obstacles: &[Vec<bool>]) -> Value {
    let row = |row: &Vec<bool>| row.iter().map(|&obstacle| u8::from(obstacle)).collect::<Vec<_>>();
    json!(obstacles.iter().map(row).collect::<Vec<_>>())
}

/// Draws a map text in which pairs of letters mark starts and goals.
fn lettered(dice: &mut Dice, obstacles: &[Vec<bool>]) -> String {
    let mut letters: Vec<char> = text(obstacles).chars().collect();
    let mut places: Vec<usize> = (0..letters.len()).filter(|&at| letters[at] != '\n').collect();
    dice.shuffle(&mut places);
    let num_agents = dice.between(1, (places.len() / 2).clamp(1, 26));
    let mut names: Vec<char> = ('a'..='z').collect();
    dice.shuffle(&mut names);
    let mut goal_names = names.clone();
    if dice.chance(0.3) {
        dice.shuffle(&mut goal_names);
    }
    for (agent, cells) in places.chunks_exact(2).take(num_agents).enumerate() {
        letters[cells[0]] = names[agent];
        letters[cells[1]] = goal_names[agent].to_ascii_uppercase();
    }
    letters.into_iter().collect()
}

/// Draws a map text in which some free cells are marked as possible starts, possible goals or neither.
fn marked(dice: &mut Dice, obstacles: &[Vec<bool>]) -> String {
    let mark = |character: char, dice: &mut Dice| {
        if character == '.' { dice.pick(&['.', '@', '@', '$', '$', '!']) } else { character }
    };
    text(obstacles).chars().map(|character| mark(character, dice)).collect()
}
