//! Action scripts of random episodes, for example random moves, moves to the goals, and conflicts.

use pogema_core::{Action, Cell, Map, Snapshot};

use crate::dice::Dice;
use crate::play::{NamedEngine, Player};
use crate::request::{Op, Record, Request, Response};

/// The way in which the agents of an episode choose their actions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Script {
    /// Uniformly at random.
    Random,
    /// Mostly towards the goal.
    GoalSeeking,
    /// Towards an adjacent agent, or into a cell that another agent can enter too.
    Adversarial,
    /// Nearly all in one direction, which makes long chains, and long cascades at walls.
    Convoy,
    /// In circles over the four cells of a block.
    Carousel,
    /// With POGEMA's A* policy.
    Astar,
    /// With POGEMA's random policy.
    Sample,
}

const MAX_STEPS: usize = 26;

/// Adds operations to a request while playing it, so that the actions can depend on the state.
///
/// Returns the complete request and the answer of the given engine.
pub fn play_script(engine: NamedEngine, mut request: Request, seed: u64) -> (Request, Response) {
    let mut dice = Dice::new(seed ^ 0x5ca1_ab1e, request.id);
    let Ok(mut player) = Player::new(&engine.make, &request) else {
        request.ops.push(Op::Reset(None));
        return (request.clone(), crate::play_on(engine, &request));
    };
    let num_episodes = if dice.chance(0.2) { 2 } else { 1 };
    for _ in 0..num_episodes {
        if play_episode(&mut player, &mut dice, &mut request).is_none() {
            break;
        }
    }
    // Play the operations again from the start, as every other implementation will.
    let response = crate::play_on(engine, &request);
    (request, response)
}

/// Plays an episode and adds its operations to the request. Returns `None` after an operation that failed.
fn play_episode(player: &mut Player, dice: &mut Dice, request: &mut Request) -> Option<()> {
    let script = draw_script(dice, player);
    // No step between the resets, because POGEMA adds the counters of an abandoned episode to the next one.
    for _ in 0..if dice.chance(0.15) { 3 } else { 1 } {
        let seed = dice.chance(0.2).then(|| dice.below(1000) as u64);
        perform(player, Op::Reset(seed), request)?;
    }
    let max_steps = player.config.max_episode_steps.clamp(1, MAX_STEPS as i64) as usize;
    let num_extra = if dice.chance(0.2) { 2 } else { 0 };
    let can_go_back = player.config.persistent && script != Script::Astar && can_compare_back(player);
    let mut ended = 0;
    for _ in 0..max_steps + num_extra {
        let op = match script {
            Script::Astar => Op::Astar,
            Script::Sample => Op::Sample,
            _ => Op::Step(choose(script, player, dice)),
        };
        let mut record = perform(player, op, request)?;
        while can_go_back && dice.chance(0.2) {
            record = perform(player, Op::Back, request)?;
        }
        let is_over = record.step().is_some_and(|step| {
            let all = |flags: &[bool]| flags.iter().all(|&flag| flag);
            all(&step.step.terminated) || all(&step.step.truncated)
        });
        ended += usize::from(is_over);
        if ended > num_extra {
            break;
        }
    }
    if player.config.persistent {
        perform(player, Op::History, request)?;
    }
    Some(())
}

/// Returns whether steps back can be compared. In POGEMA they fail if an agent has vanished or returns to an obstacle.
fn can_compare_back(player: &Player) -> bool {
    player.config.collision_system != pogema_core::Collision::Soft
        && player.config.possible_agents_xy.is_none()
}

/// Adds an operation to the request and performs it; returns `None` if it fails.
fn perform(player: &mut Player, op: Op, request: &mut Request) -> Option<Record> {
    let result = player.perform(&op);
    request.ops.push(op);
    result.ok()
}

fn draw_script(dice: &mut Dice, player: &Player) -> Script {
    let has_policy_view = player.config.observation_type != pogema_core::Observation::Default;
    match dice.below(10) {
        0 if has_policy_view => Script::Astar,
        1 if player.config.seed.is_some() => Script::Sample,
        2 => Script::Random,
        3 | 4 => Script::GoalSeeking,
        5 | 6 => Script::Adversarial,
        7 | 8 => Script::Convoy,
        _ => Script::Carousel,
    }
}

fn choose(script: Script, player: &Player, dice: &mut Dice) -> Vec<i64> {
    let state = player.episode.snapshot();
    let Ok(map) = player.episode.instance().map(pogema_core::Instance::map) else { return Vec::new() };
    let common = dice.pick(&Action::ALL);
    let mut actions = Vec::with_capacity(state.cells.len());
    for agent in 0..state.cells.len() {
        let any = dice.pick(&Action::ALL);
        let action = match script {
            _ if dice.chance(0.12) => any,
            Script::GoalSeeking => toward_goal(&state, agent, dice),
            Script::Adversarial => at_neighbour(map, &state, agent, dice),
            Script::Convoy => common,
            Script::Carousel => around_block(state.cells[agent]),
            Script::Random | Script::Astar | Script::Sample => any,
        };
        actions.push(action as i64);
    }
    actions
}

fn toward_goal(state: &Snapshot, agent: usize, dice: &mut Dice) -> Action {
    let (cell, goal) = (state.cells[agent], state.goals[agent]);
    let down = if goal.row > cell.row { Action::Down } else { Action::Up };
    let right = if goal.col > cell.col { Action::Right } else { Action::Left };
    match (goal.row == cell.row, goal.col == cell.col) {
        (true, true) => Action::Stay,
        (true, false) => right,
        (false, true) => down,
        (false, false) => dice.pick(&[down, right]),
    }
}

/// Returns a move towards another agent that is adjacent or two cells away; a random move if there is no such agent.
///
/// If the adjacent agent does the same, the two moves are a swap. The move towards an agent two cells away contests the
/// cell between.
fn at_neighbour(map: &Map, state: &Snapshot, agent: usize, dice: &mut Dice) -> Action {
    let mut moves = Action::MOVES;
    dice.shuffle(&mut moves);
    let at = |action: Action, reach: i32| {
        let (down, right) = action.delta();
        let row = i32::from(state.cells[agent].row) + reach * down;
        let col = i32::from(state.cells[agent].col) + reach * right;
        Cell::checked((row, col))
    };
    let holds_agent = |cell: Option<Cell>| {
        cell.is_some_and(|cell| {
            (0..state.cells.len()).any(|other| state.active[other] && state.cells[other] == cell)
        })
    };
    let is_free = |cell: Option<Cell>| cell.is_some_and(|cell| !map.is_obstacle(cell));
    let reach = if dice.chance(0.5) { [1, 2] } else { [2, 1] };
    for reach in reach {
        let aims = |&&action: &&Action| is_free(at(action, 1)) && holds_agent(at(action, reach));
        if let Some(&action) = moves.iter().find(aims) {
            return action;
        }
    }
    moves[0]
}

fn around_block(cell: Cell) -> Action {
    match (cell.row % 2, cell.col % 2) {
        (0, 0) => Action::Right,
        (0, _) => Action::Down,
        (_, 0) => Action::Up,
        _ => Action::Left,
    }
}
