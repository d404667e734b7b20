//! Plans as text: one line for each step, or a result file of the LaCAM programs.
//!
//! ```text
//! 0: (0,0) (4,2)
//! 1: (0,1) (3,2)
//! ```
//!
//! A line holds an optional step number and the cells of all agents as `(row,col)`. Commas between cells are ignored.
//! Except in a result file, lines that begin with `#` are ignored too. A result file contains the line `solution=`,
//! preceded by fields such as `map_file=`, `starts=` and `goals=`. All its cells are `(x,y)`, column first.

use std::fmt::Write as _;

use pogema_core::{Cell, Error, counted, shorten};

use crate::outcome::Outcome;
use crate::plan::Plan;
use crate::problem::Problem;

/// The content of a plan file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlanText {
    /// The plan.
    pub plan: Plan,
    /// The name of the map file, if the plan file contains it.
    pub map_file: Option<String>,
    /// The starts, if the plan file contains them.
    pub starts: Option<Vec<Cell>>,
    /// The goals, if the plan file contains them.
    pub goals: Option<Vec<Cell>>,
}

impl PlanText {
    /// Reads a plan in either format.
    ///
    /// # Errors
    /// [`Error::Plan`] for text in neither format and for steps with different numbers of agents, naming the
    /// line; also for text without a step and for a result without a solution.
    pub fn read(text: &str) -> Result<Self, Error> {
        let lines: Vec<(usize, &str)> =
            (1..).zip(text.lines().map(str::trim)).filter(|(_, line)| !line.is_empty()).collect();
        if let Some(at) = lines.iter().position(|(_, line)| *line == "solution=") {
            return read_result(&lines[..at], &lines[at + 1..]);
        }
        let lines: Vec<_> = lines.into_iter().filter(|(_, line)| !line.starts_with('#')).collect();
        let plan = read_steps(&lines, Order::RowCol)?;
        Ok(Self { plan, map_file: None, starts: None, goals: None })
    }
}

/// Returns the text of a plan, one line for each step.
pub fn write_plan(plan: &Plan) -> String {
    let mut text = String::new();
    for (step, cells) in plan.cells().iter().enumerate() {
        let cells: Vec<String> = cells.iter().map(|cell| format!("({},{})", cell.row, cell.col)).collect();
        let _ = writeln!(text, "{step}: {}", cells.join(" "));
    }
    text
}

/// Returns the text of a result file of the LaCAM programs, which their visualisers can read.
pub fn write_result(map_file: &str, solver: &str, problem: &Problem, outcome: &Outcome) -> String {
    let cells = |cells: Vec<Cell>| -> String {
        let cells: Vec<String> =
            cells.into_iter().map(|cell| format!("({},{}),", cell.col, cell.row)).collect();
        cells.concat()
    };
    let of = |vertices: &[u32]| cells(vertices.iter().map(|&vertex| problem.graph.cell(vertex)).collect());
    let mut text = format!("agents={}\nmap_file={map_file}\nsolver={solver}\n", problem.num_agents());
    let _ = writeln!(text, "solved={}", u8::from(outcome.solution().is_some()));
    if let Outcome::Solved { plan, lower_bound } = outcome {
        let (cost, makespan) = (plan.sum_of_costs(), plan.makespan());
        let _ = writeln!(text, "soc={cost}\nsoc_lb={lower_bound}\nmakespan={makespan}");
    }
    let _ = writeln!(text, "starts={}\ngoals={}\nsolution=", of(&problem.starts), of(&problem.goals));
    for (step, now) in outcome.solution().map(Plan::cells).unwrap_or_default().iter().enumerate() {
        let _ = writeln!(text, "{step}:{}", cells(now.clone()));
    }
    text
}

/// The order of the two numbers of a cell.
#[derive(Clone, Copy)]
enum Order {
    RowCol,
    XY,
}

fn read_result(fields: &[(usize, &str)], steps: &[(usize, &str)]) -> Result<PlanText, Error> {
    let mut result = (None, None, None);
    for &(line, field) in fields {
        let (name, value) =
            field.split_once('=').ok_or_else(|| wrong(line, field, "a field such as `agents=2`"))?;
        match name {
            "map_file" => result.0 = Some(value.to_owned()),
            "starts" => result.1 = Some(read_cells(line, value, Order::XY)?),
            "goals" => result.2 = Some(read_cells(line, value, Order::XY)?),
            _ => {}
        }
    }
    if steps.is_empty() {
        return Err(Error::Plan {
            reason: "the result contains no solution, expected steps after the line `solution=`".into(),
        });
    }
    let plan = read_steps(steps, Order::XY)?;
    let (map_file, starts, goals) = result;
    Ok(PlanText { plan, map_file, starts, goals })
}

fn read_steps(lines: &[(usize, &str)], order: Order) -> Result<Plan, Error> {
    if lines.is_empty() {
        return Err(Error::Plan {
            reason: "the text contains no step, expected a line such as `0: (3,4)`".into(),
        });
    }
    let mut steps: Vec<Vec<Cell>> = Vec::with_capacity(lines.len());
    for &(line, text) in lines {
        let cells = match text.split_once(':') {
            Some((number, cells)) if number.trim().parse() == Ok(steps.len()) => cells,
            Some((number, _)) => return Err(wrong(line, number, &format!("step {}", steps.len()))),
            None => text,
        };
        let cells = read_cells(line, cells, order)?;
        if let Some(first) = steps.first().filter(|first| first.len() != cells.len()) {
            let reason = format!(
                "line {line}: found {}, expected {}, as in the first step",
                counted(cells.len(), "cell"),
                first.len()
            );
            return Err(Error::Plan { reason });
        }
        steps.push(cells);
    }
    Plan::new(steps)
}

fn read_cells(line: usize, text: &str, order: Order) -> Result<Vec<Cell>, Error> {
    let between = |character: char| character == ',' || character.is_whitespace();
    let mut cells = Vec::new();
    let mut rest = text.trim_matches(between);
    while !rest.is_empty() {
        let (cell, after) = rest
            .strip_prefix('(')
            .and_then(|inside| inside.split_once(')'))
            .ok_or_else(|| wrong(line, rest, "a cell such as `(3,4)`"))?;
        let numbers = cell.split_once(',').and_then(|(first, second)| {
            Some((first.trim().parse::<u16>().ok()?, second.trim().parse::<u16>().ok()?))
        });
        let (first, second) =
            numbers.ok_or_else(|| wrong(line, cell, "two whole numbers from 0 to 65535, such as `3,4`"))?;
        cells.push(match order {
            Order::RowCol => Cell { row: first, col: second },
            Order::XY => Cell { row: second, col: first },
        });
        rest = after.trim_start_matches(between);
    }
    Ok(cells)
}

fn wrong(line: usize, found: &str, expected: &str) -> Error {
    let found = shorten(found, Error::LONGEST_QUOTE);
    Error::Plan { reason: format!("line {line}: found `{found}`, expected {expected}") }
}
