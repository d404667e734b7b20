//! Conflicting moves of a group.

/// Withdraws the moves that conflict, as POGEMA's `soft` does for the agents of a group alone.
///
/// `moves` says which agents move if no other agent hinders them: all except those that wait or aim at an obstacle.
/// `places` holds the place of each agent, and `targets` the place that it aims at. On return, `moves` says which
/// agents move. An agent takes precedence over those after it in the group.
///
/// The fast engine resolves the moves of all agents of an environment on a board. A group has a few agents and no
/// board, so this function compares the agents in pairs.
///
/// Rule: collide/soft, collide/soft/swap, collide/soft/contest, collide/soft/chain
pub(super) fn withdraw_conflicts(places: &[u32], targets: &[u32], moves: &mut [bool]) {
    for one in 0..places.len() {
        for other in 0..one {
            if targets[one] == places[other] && targets[other] == places[one] {
                moves[one] = false;
                moves[other] = false;
            }
        }
    }
    loop {
        let mut changed = false;
        for agent in 0..places.len() {
            let hinders = |other: usize| {
                other != agent
                    && if moves[other] {
                        other < agent && targets[other] == targets[agent]
                    } else {
                        places[other] == targets[agent]
                    }
            };
            if moves[agent] && (0..places.len()).any(hinders) {
                moves[agent] = false;
                changed = true;
            }
        }
        if !changed {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use pogema_core::{
        Action, Cell, Collision, Config, Environment, Error, GoalStream, Instance, Map, Outside, StepResults,
    };
    use pogema_numpy::Generator;
    use pogema_reference::Reference;

    use super::*;
    use crate::mats_lp::world::World;

    /// Draws a map and agents on its free cells, in a random order.
    fn draw(generator: &mut Generator) -> Result<(Map, Vec<Cell>), Error> {
        let mut below = |most: usize| (generator.random() * most as f64) as usize;
        let (height, width) = (1 + below(5), 1 + below(5));
        let obstacles = (0..height * width).map(|_| generator.random() < 0.15).collect();
        let map = Map::new(height, width, obstacles)?;
        let mut agents: Vec<(f64, Cell)> = map.free_cells().map(|cell| (generator.random(), cell)).collect();
        agents.sort_by(|one, other| one.0.total_cmp(&other.0));
        let mut cells: Vec<Cell> = agents.into_iter().map(|(_, cell)| cell).collect();
        cells.truncate((generator.random() * (cells.len() + 1) as f64) as usize);
        Ok((map, cells))
    }

    fn by_engine(map: &Map, cells: &[Cell], actions: &[Action]) -> Result<Vec<Cell>, Error> {
        let config = Config { num_agents: cells.len(), collision: Collision::Soft, ..Config::default() };
        let goals = cells.iter().map(|&cell| GoalStream::single(cell)).collect();
        let mut engine = Reference::new(config)?;
        engine.reset(&Instance::new(map.clone(), Outside::Free, cells.to_vec(), goals)?)?;
        engine.step(actions, StepResults::new(cells.len()).out())?;
        Ok(engine.state().cells.to_vec())
    }

    #[test]
    fn groups_move_as_in_the_reference_engine() -> Result<(), Error> {
        let mut generator = Generator::seeded(5);
        let mut num_moved = 0;
        for number in 0..20_000 {
            let (map, cells) = draw(&mut generator)?;
            if cells.is_empty() {
                continue;
            }
            let actions = pogema_planners::sample(&mut generator, cells.len());
            let world = World::new(&map, 1);
            let places: Vec<u32> = cells.iter().map(|&cell| world.layout.place(cell) as u32).collect();
            let toward = |(&place, &action): (&u32, &Action)| world.toward(place, action);
            let targets: Vec<u32> = places.iter().zip(&actions).map(toward).collect();
            let mut moves: Vec<bool> = targets
                .iter()
                .zip(&actions)
                .map(|(&target, &action)| action != Action::Stay && world.is_free(target))
                .collect();
            withdraw_conflicts(&places, &targets, &mut moves);
            let expected: Vec<u32> = by_engine(&map, &cells, &actions)?
                .into_iter()
                .map(|cell| world.layout.place(cell) as u32)
                .collect();
            let reached: Vec<u32> = (0..cells.len())
                .map(|agent| if moves[agent] { targets[agent] } else { places[agent] })
                .collect();
            assert_eq!(reached, expected, "{number}: {:?} {cells:?} {actions:?}", map.rows());
            num_moved += moves.iter().filter(|&&moves| moves).count();
        }
        assert!(num_moved > 10_000, "{num_moved}");
        Ok(())
    }
}
