//! A user's own source draws the next goal from the cell that was reached, and by default its goals cannot be saved. A
//! saved position that belongs to other goals is rejected.

#![allow(clippy::unwrap_used, reason = "tests may panic")]

use pogema_core::{Cell, Error, GoalSource, GoalStream, StreamState};

/// Draws the cell to the right of the one that was reached.
#[derive(Clone, Debug)]
struct ToTheRight;

impl GoalSource for ToTheRight {
    fn next_goal(&mut self, at: Cell) -> Cell {
        Cell::new(at.row, at.col + 1)
    }

    fn boxed_clone(&self) -> Box<dyn GoalSource> {
        Box::new(self.clone())
    }
}

#[test]
fn a_source_draws_from_the_reached_cell_and_by_default_cannot_be_saved() {
    let mut goals = GoalStream::drawn(Cell::new(0, 3), Box::new(ToTheRight));
    assert_eq!(goals.first(), Cell::new(0, 3));
    assert_eq!(goals.advance(Cell::new(0, 3)), Cell::new(0, 4));
    let unsaved = goals.save().unwrap_err();
    assert!(matches!(unsaved, Error::UnsavedGoals), "{unsaved:?}");
    assert_eq!(unsaved.to_string(), "the goals come from a source that cannot be saved");
    for state in [StreamState::Same, StreamState::Sequence(0), StreamState::Drawn("0".into())] {
        assert!(matches!(goals.restore(&state), Err(Error::ForeignGoals)), "{state:?}");
    }
    assert_eq!(goals.advance(Cell::new(2, 5)), Cell::new(2, 6));
}

#[test]
fn a_saved_position_of_other_goals_is_rejected_and_changes_nothing() {
    let cells = [Cell::new(0, 0), Cell::new(0, 1), Cell::new(0, 2)];
    let mut goals = GoalStream::sequence(cells[0], cells.into());
    assert_eq!(goals.advance(cells[0]), cells[1]);
    for state in [StreamState::Same, StreamState::Sequence(3), StreamState::Drawn(String::new())] {
        assert!(matches!(goals.restore(&state), Err(Error::ForeignGoals)), "{state:?}");
        assert_eq!(goals.save().unwrap(), StreamState::Sequence(1));
    }
    goals.restore(&StreamState::Sequence(2)).unwrap();
    assert_eq!(goals.advance(cells[2]), cells[0]);
}
