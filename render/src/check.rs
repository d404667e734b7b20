//! Checks of traces before drawing.

use pogema_core::{Cell, Error, Trace};

/// Checks that every state has as many agents as the first, and that all agents and goals are on the map.
///
/// # Errors
/// [`Error::Length`] or [`Error::OutOfRange`] for the first state that cannot be drawn.
pub fn check(trace: &Trace) -> Result<(), Error> {
    let (map, num_agents) = (&trace.header.map, trace.start.state.cells.len());
    for (frame, state) in trace.states().enumerate() {
        Error::check_length("cells", num_agents, state.cells.len())?;
        Error::check_length("goals", num_agents, state.goals.len())?;
        Error::check_length("active", num_agents, state.active.len())?;
        let is_off = |cell: &&Cell| !map.contains(**cell);
        if let Some(cell) = state.cells.iter().chain(&state.goals).find(is_off) {
            let expected = format!("a cell of the map of {} rows and {} columns", map.height(), map.width());
            return Err(Error::out_of_range(&format!("a cell of frame {frame}"), cell, expected));
        }
    }
    Ok(())
}

/// Checks that `agent` is less than `num_agents`.
pub(crate) fn check_agent(agent: usize, num_agents: usize) -> Result<(), Error> {
    match num_agents.checked_sub(1) {
        Some(last) if agent <= last => Ok(()),
        Some(last) => Err(Error::out_of_range("agent", agent, format!("0 to {last}"))),
        None => Err(Error::out_of_range("agent", agent, "none, because the episode has no agents")),
    }
}
