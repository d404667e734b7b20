//! `pogema validate`: checks whether a plan is valid.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use pogema_core::{Cell, Error, Instance, Map};
use pogema_maps::files::{Reading, read_maps, read_text_within};
use pogema_planners::{Conflict, Plan, PlanText, validate};
use serde_json::{Value, json};

use crate::input::Input;
use crate::output::{print_json, print_line};
use crate::run::Settings;

/// Rows and columns drawn around a conflict.
const DRAWN: (usize, usize) = (13, 31);

#[derive(Args, Debug)]
pub struct Validate {
    /// Plan to validate: a file with one line of cells `(row,col)` per step, or a result file of LaCAM
    plan: PathBuf,
    #[command(flatten)]
    settings: Settings,
    #[command(flatten)]
    input: Input,
    /// Do not require that agents end on their goals
    #[arg(long)]
    any_end: bool,
    /// Print the verdict as JSON
    #[arg(long)]
    json: bool,
}

/// A plan and the instance that it solves.
struct Task {
    map: Map,
    starts: Vec<Cell>,
    goals: Vec<Cell>,
    plan: Plan,
}

impl Validate {
    /// Validates the plan and prints the verdict; exit status 1 if the plan is not valid.
    pub fn run(&self) -> Result<ExitCode, Error> {
        let task = self.task()?;
        let goals = (!self.any_end).then_some(task.goals.as_slice());
        let verdict = validate(&task.map, &task.starts, goals, &task.plan);
        if self.json {
            print_json(&as_json(&task.plan, &verdict))?;
        } else {
            print_line(&as_text(&task, &verdict))?;
        }
        Ok(if verdict.is_ok() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }

    /// Reads the plan and its instance; the config and the flags supply what the file does not contain.
    fn task(&self) -> Result<Task, Error> {
        let in_file = |error| Error::io(&self.plan, error);
        let text = read_text_within(&self.plan, self.input.limit())?;
        let text = PlanText::read(&text).map_err(in_file)?;
        let (Some(starts), Some(goals)) = (text.starts, text.goals) else {
            let instance = self.instance(text.plan.num_agents())?;
            let (starts, goals) = (instance.starts().to_vec(), instance.first_goals());
            return Ok(Task { map: instance.map().clone(), starts, goals, plan: text.plan });
        };
        let map = match text.map_file.filter(|_| !self.settings.has_map()) {
            Some(name) => self.map_beside(&name)?,
            None => self.settings.map()?,
        };
        Ok(Task { map, starts, goals, plan: text.plan })
    }

    fn instance(&self, num_agents: usize) -> Result<Instance, Error> {
        let config = self.settings.config_for(Some(num_agents))?;
        Ok(self.settings.generate(&config)?.instance)
    }

    /// Reads the map that a result file names; searches the folder of the result, then the current folder.
    fn map_beside(&self, name: &str) -> Result<Map, Error> {
        let folder = self.plan.parent().unwrap_or(Path::new(""));
        let file = Path::new(name).file_name().map(PathBuf::from).unwrap_or_default();
        let places = [folder.join(name), folder.join(&file), PathBuf::from(name)];
        let Some(place) = places.into_iter().find(|place| place.is_file()) else {
            let reason = format!("map `{name}` not found, expected it next to the plan, or `--map FILE`");
            return Err(Error::io(&self.plan, reason));
        };
        let mut maps = read_maps(&place, Reading::default())?;
        Ok(maps.swap_remove(0).text.map)
    }
}

fn as_text(task: &Task, verdict: &Result<(), Conflict>) -> String {
    let plan = &task.plan;
    match verdict {
        Ok(()) => {
            let (agents, steps) = (plan.num_agents(), plan.num_steps());
            let (cost, makespan) = (plan.sum_of_costs(), plan.makespan());
            format!("valid: {agents} agents, {steps} steps; sum of costs {cost}, makespan {makespan}")
        }
        Err(conflict) => match conflict.cell {
            Some(cell) => format!("not valid: {conflict}\n\n{}", drawing(task, conflict, cell)),
            None => format!("not valid: {conflict}"),
        },
    }
}

fn as_json(plan: &Plan, verdict: &Result<(), Conflict>) -> Value {
    let (cost, makespan) = (plan.sum_of_costs(), plan.makespan());
    let conflict = verdict.as_ref().err().map(|conflict| {
        let Conflict { step, agents, cell, .. } = conflict;
        json!({"step": step, "agents": agents, "cell": cell, "text": conflict.to_string()})
    });
    json!({
        "valid": verdict.is_ok(),
        "num_agents": plan.num_agents(),
        "num_steps": plan.num_steps(),
        "sum_of_costs": cost,
        "makespan": makespan,
        "conflict": conflict,
    })
}

/// Draws the neighbourhood of a conflict before and after its step.
fn drawing(task: &Task, conflict: &Conflict, cell: Cell) -> String {
    let before = conflict.step.saturating_sub(1);
    let corner = |at: u16, shown: usize, all: usize| {
        usize::from(at).saturating_sub(shown / 2).min(all.saturating_sub(shown))
    };
    let (height, width) = (task.map.height(), task.map.width());
    let (num_rows, num_cols) = (DRAWN.0.min(height), DRAWN.1.min(width));
    let top = corner(cell.row, num_rows, height);
    let left = corner(cell.col, num_cols, width);
    let (rows, cols) = (top..top + num_rows, left..left + num_cols);
    let names = conflict.agents.iter().zip(["a", "b"]);
    let names: Vec<String> = names.map(|(agent, letter)| format!("{letter} is agent {agent}")).collect();
    let (bottom, right) = (rows.end - 1, cols.end - 1);
    let head = format!("rows {top} to {bottom}, columns {left} to {right}; {}", names.join(", "));
    let show = |step| picture(task, conflict, (&rows, &cols), step);
    if conflict.step == before {
        return format!("{head}\nat the start:\n{}", show(before));
    }
    format!("{head}\nbefore step {}:\n{}\nafter it:\n{}", conflict.step, show(before), show(conflict.step))
}

/// Draws part of the map after a step: the conflicting agents as `a` and `b`, or `X` in one cell, others as `o`.
fn picture(
    task: &Task,
    conflict: &Conflict,
    (rows, cols): (&Range<usize>, &Range<usize>),
    step: usize,
) -> String {
    let letter = |row: usize, col: usize| {
        let cell = Cell { row: row as u16, col: col as u16 };
        let here = |agent: &usize| task.plan.cells()[step][*agent] == cell;
        let conflicting: Vec<usize> =
            (0..conflict.agents.len()).filter(|&at| here(&conflict.agents[at])).collect();
        match conflicting.as_slice() {
            [0] => 'a',
            [_] => 'b',
            [_, ..] => 'X',
            [] if task.plan.cells()[step].contains(&cell) => 'o',
            [] if task.map.is_obstacle(cell) => '#',
            [] => '.',
        }
    };
    let line = |row: usize| format!("    {}", cols.clone().map(|col| letter(row, col)).collect::<String>());
    rows.clone().map(line).collect::<Vec<_>>().join("\n")
}
