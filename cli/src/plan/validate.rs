//! `pogema validate`: checks whether a plan is valid.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use pogema_core::{Cell, Error, Map, counted};
use pogema_maps::files::{MovingAiOptions, read_maps, read_text_within};
use pogema_planners::{Conflict, Plan, PlanText, validate, validate_arrivals};
use serde_json::{Value, json};

use crate::input::Input;
use crate::output::{print_json, print_line};
use crate::run::{Settings, only_map};

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

/// A plan and its instance.
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
        let max_steps = self.settings.max_steps()?;
        let verdict = validate(&task.map, &task.starts, goals, &task.plan)
            .and_then(|()| max_steps.map_or(Ok(()), |max_steps| validate_arrivals(&task.plan, max_steps)));
        if self.json {
            print_json(&as_json(&task.plan, &verdict))?;
        } else {
            print_line(&as_text(&task, &verdict))?;
        }
        Ok(if verdict.is_ok() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }

    /// Reads the plan and its instance; the config and the flags supply what the file does not contain.
    ///
    /// # Errors
    /// If the file, the config and the flags together leave the instance undetermined, or if the starts or goals of the
    /// config and the flags differ from those of the file. The map of the config and the flags is not compared: it
    /// replaces the map of the file.
    fn task(&self) -> Result<Task, Error> {
        let in_file = |reason: String| Error::io(&self.plan, reason);
        let text = read_text_within(&self.plan, self.input.limit())?;
        let PlanText { map_file, starts, goals, plan, .. } =
            PlanText::read(&text).map_err(|error| Error::io(&self.plan, error))?;
        let num_agents = plan.num_agents();
        let config = self.settings.config_for(Some(num_agents))?;
        let has_agents = config.agents_xy.as_ref().is_some_and(|starts| !starts.is_empty());
        let is_certain = config.seed.is_some() || config.map.is_some() && has_agents;
        let given = is_certain.then(|| self.settings.generate(&config)).transpose()?;
        let given = given.map(|generated| generated.instance);
        let task = |map, starts, goals| Ok(Task { map, starts, goals, plan });
        match (starts, goals, given) {
            (None, None, Some(given)) => {
                task(given.map().clone(), given.starts().to_vec(), given.first_goals())
            }
            (Some(starts), Some(goals), Some(given)) => {
                if (starts.as_slice(), &goals) != (given.starts(), &given.first_goals()) {
                    let reason =
                        "its starts and goals are not those of the instance that the other arguments name";
                    return Err(in_file(reason.into()));
                }
                task(given.map().clone(), starts, goals)
            }
            (Some(_), Some(_), None) if config.num_agents != num_agents => {
                let found = counted(num_agents, "agent");
                Err(in_file(format!("the plan has {found}, expected {}", config.num_agents)))
            }
            (Some(starts), Some(goals), None) => {
                match (config.map, map_file.filter(|name| !name.is_empty())) {
                    (Some(map), _) => task(map, starts, goals),
                    (None, Some(name)) => task(self.map_beside(&name)?, starts, goals),
                    (None, None) => Err(unknown_instance()),
                }
            }
            (None, None, None) => Err(unknown_instance()),
            _ => Err(in_file("expected both `starts` and `goals`, or neither".into())),
        }
    }

    /// Reads the map that a result file names; searches the folder of the result, the current folder, then the known
    /// maps.
    fn map_beside(&self, name: &str) -> Result<Map, Error> {
        let folder = self.plan.parent().unwrap_or(Path::new(""));
        let file = Path::new(name).file_name().map(PathBuf::from).unwrap_or_default();
        let places = [folder.join(name), folder.join(&file), PathBuf::from(name)];
        match places.into_iter().find(|place| place.is_file()) {
            Some(place) => {
                let maps = read_maps(&place, MovingAiOptions::default())?;
                Ok(only_map(&place.to_string_lossy(), maps)?.map)
            }
            None => self.settings.map_named(name).map_err(|_| {
                let reason = format!("map `{name}` not found, expected it next to the plan, or `--map FILE`");
                Error::io(&self.plan, reason)
            }),
        }
    }
}

fn unknown_instance() -> Error {
    Error::request(
        "expected the instance of the plan: `--map` with `--scenario`, a config, or the `--seed` that it was made with",
    )
}

fn as_text(task: &Task, verdict: &Result<(), Conflict>) -> String {
    let plan = &task.plan;
    match verdict {
        Ok(()) => {
            let (agents, steps) = (counted(plan.num_agents(), "agent"), counted(plan.num_steps(), "step"));
            let (cost, makespan) = (plan.sum_of_costs(), plan.makespan());
            format!("valid: {agents}, {steps}; sum of costs {cost}, makespan {makespan}")
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

/// Draws part of the map after a step: the conflicting agents as `a` and `b`, or as `X` if they are in one cell,
/// and other agents as `o`.
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
