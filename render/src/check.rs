//! Checks of traces before drawing.

use pogema_core::{Cell, Error, Snapshot, Trace, TraceStep, rows_and_columns};

/// Checks that a trace can be drawn.
///
/// A trace can be drawn if:
/// - noise has the size of the map with its border;
/// - every list has one entry per agent;
/// - all agents and goals are on the map;
/// - no agent moves farther than to a neighbouring cell in one step.
///
/// # Errors
/// [`Error::Length`], [`Error::OutOfRange`] or [`Error::Trace`] for the first check that fails.
pub fn check(trace: &Trace) -> Result<(), Error> {
    let header = &trace.header;
    header.outside.check_fits(&header.map, &header.config)?;
    let num_agents = header.config.num_agents;
    for (frame, state) in trace.states().enumerate() {
        check_state(trace, frame, state, num_agents)?;
    }
    // The header and the start are the first two lines of the file.
    for ((line, before), step) in (3..).zip(trace.states()).zip(&trace.steps) {
        check_step(step, num_agents)?;
        let cells = before.cells.iter().zip(&step.state.cells);
        let mut moves = cells.enumerate();
        if let Some((agent, (from, to))) = moves.find(|(_, (from, to))| from.action_to(**to).is_none()) {
            let reason = format!("agent {agent} is on {to}, expected {from} or a cell next to it");
            return Err(Error::Trace { line, reason });
        }
    }
    Ok(())
}

fn check_state(trace: &Trace, frame: usize, state: &Snapshot, num_agents: usize) -> Result<(), Error> {
    Error::check_length("cells", num_agents, state.cells.len())?;
    Error::check_length("goals", num_agents, state.goals.len())?;
    Error::check_length("active", num_agents, state.active.len())?;
    Error::check_length("on_goal", num_agents, state.on_goal.len())?;
    let map = &trace.header.map;
    let is_off = |cell: &&Cell| !map.contains(**cell);
    if let Some(cell) = state.cells.iter().chain(&state.goals).find(is_off) {
        let expected = format!("a cell of the map of {}", rows_and_columns(map.height(), map.width()));
        return Err(Error::out_of_range(&format!("a cell of frame {frame}"), cell, expected));
    }
    Ok(())
}

fn check_step(step: &TraceStep, num_agents: usize) -> Result<(), Error> {
    Error::check_length("actions", num_agents, step.actions.len())?;
    Error::check_length("rewards", num_agents, step.rewards.len())?;
    Error::check_length("terminated", num_agents, step.terminated.len())?;
    Error::check_length("truncated", num_agents, step.truncated.len())
}

/// Checks that `agent` is less than `num_agents`.
pub(crate) fn check_agent(agent: usize, num_agents: usize) -> Result<(), Error> {
    match num_agents.checked_sub(1) {
        Some(last) if agent <= last => Ok(()),
        Some(last) => Err(Error::out_of_range("agent", agent, format!("0 to {last}"))),
        None => Err(Error::out_of_range("agent", agent, "none, because the episode has no agents")),
    }
}
