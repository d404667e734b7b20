//! `pogema maps stats`: statistics of maps, and solvability of scenarios.

use std::path::PathBuf;

use clap::Args;
use comfy_table::Table;
use pogema_core::{Cell, Error, Map, OnGoal, Words, counted, one_line};
use pogema_maps::files::read_scenario;
use pogema_maps::formats::{NamedMap, Scenario};
use pogema_maps::{Generated, GridConfig, Infeasibility, InstanceSource, MapStats, ScenarioStats};
use pogema_planners::{Solvability, solvability};
use serde_json::{Value, json};

use super::{Sources, ambiguous_map, number_of_agents};
use crate::output::{markdown_table, print_json, print_line, print_table, tell_warnings};
use crate::words::word_of;

#[derive(Args, Debug)]
pub struct Stats {
    /// Map to analyse: a name, a pattern of names, a file or a folder
    map: String,
    #[command(flatten)]
    sources: Sources,
    /// Starts and goals: a .scen file, or a YAML file with `agents_xy` and `targets_xy` [default: those of the map]
    #[arg(long, value_name = "FILE", conflicts_with = "seed")]
    scenario: Option<PathBuf>,
    /// Number of agents: with `--seed`, the number that POGEMA places; otherwise the first N of the scenario or map
    /// [default: all]
    #[arg(long, value_name = "N", value_parser = number_of_agents())]
    num_agents: Option<usize>,
    /// Place agents as POGEMA does with this seed; requires `--num-agents`
    #[arg(long, value_name = "S", requires = "num_agents")]
    seed: Option<u64>,
    /// Effect of reaching a goal, as the bounds and proofs assume it
    #[arg(long, default_value_t = OnGoal::Nothing, value_parser = word_of(&OnGoal::WORDS[..2]))]
    on_target: OnGoal,
    /// Print everything as JSON
    #[arg(long)]
    json: bool,
}

impl Stats {
    pub fn run(&self) -> Result<(), Error> {
        let maps = self.sources.resolve(&self.map)?;
        if self.scenario.is_some() && maps.len() != 1 {
            return Err(ambiguous_map(&self.map, maps.len(), "for a scenario"));
        }
        let analysed = maps.iter().map(|map| Ok((map, MapStats::of(&map.text.map), self.scenario_of(map)?)));
        let analysed: Vec<(&NamedMap, MapStats, Option<ScenarioStats>)> =
            analysed.collect::<Result<_, Error>>()?;
        if self.json {
            let all: Vec<Value> = analysed
                .iter()
                .map(|(map, stats, scenario)| as_json(map, stats, scenario.as_ref()))
                .collect();
            return print_json(&json!(all));
        }
        print_table(table(&analysed))?;
        for (map, _, scenario) in &analysed {
            if let Some(scenario) = scenario {
                print_line(&format!("{}: {}", one_line(&map.name), scenario_text(scenario)))?;
            }
        }
        Ok(())
    }

    /// Analyses the requested scenario, or the starts and goals of the map.
    fn scenario_of(&self, map: &NamedMap) -> Result<Option<ScenarioStats>, Error> {
        let on_goal = self.on_target;
        let plain_map = &map.text.map;
        if let Some(path) = &self.scenario {
            let scenario = self.first_agents(read_scenario(path, plain_map)?)?;
            return Ok(Some(analyse(plain_map, &scenario.starts, &scenario.goals.first(), on_goal)));
        }
        if let (Some(seed), Some(num_agents)) = (self.seed, self.num_agents) {
            let pools = map.text.pools.clone().unzip();
            let config = GridConfig {
                map: Some(plain_map.clone()),
                seed: Some(seed),
                num_agents,
                possible_agents_xy: pools.0,
                possible_targets_xy: pools.1,
                ..GridConfig::default()
            };
            let Generated { instance, warnings } = InstanceSource::new(config, None)?.generate()?;
            tell_warnings(&warnings);
            let goals = instance.first_goals();
            return Ok(Some(analyse(plain_map, instance.starts(), &goals, on_goal)));
        }
        let own = Scenario::new(map.text.starts.clone(), map.text.goals.clone())?;
        let own = self.first_agents(own)?;
        let has_agents = !own.starts.is_empty();
        Ok(has_agents.then(|| analyse(plain_map, &own.starts, &own.goals.first(), on_goal)))
    }

    /// Truncates a scenario to the requested number of agents; keeps all agents if no number is requested.
    fn first_agents(&self, scenario: Scenario) -> Result<Scenario, Error> {
        let found = scenario.starts.len();
        match self.num_agents {
            Some(_) if found == 0 => Err(Error::request(
                "`--num-agents` has no effect: the map has no agents; `--seed` draws them, `--scenario` reads them",
            )),
            Some(wanted) if wanted > found => {
                let expected = format!(
                    "at most {found}, the number of agents of the map or scenario; more need `--seed`"
                );
                Err(Error::argument("--num-agents", wanted, expected))
            }
            wanted => scenario.truncated(wanted.unwrap_or(found)),
        }
    }
}

/// Analyses a scenario; joint A* decides whether its small components are solvable.
fn analyse(map: &Map, starts: &[Cell], goals: &[Cell], on_goal: OnGoal) -> ScenarioStats {
    ScenarioStats::of(map, starts, goals, on_goal, |part| {
        let max_states = ScenarioStats::MAX_STATES;
        let found = solvability(&part.map, &part.starts, &part.goals, on_goal, max_states);
        found.ok().and_then(Solvability::is_solvable)
    })
}

fn table(analysed: &[(&NamedMap, MapStats, Option<ScenarioStats>)]) -> Table {
    let mut table = markdown_table(
        "map | rows | columns | free | density | components | largest | dead ends | corridor | unreachable pairs",
    );
    for (map, stats, _) in analysed {
        table.add_row([
            one_line(&map.name),
            stats.height.to_string(),
            stats.width.to_string(),
            stats.num_free.to_string(),
            format!("{:.3}", stats.density),
            stats.components.len().to_string(),
            stats.components.first().copied().unwrap_or(0).to_string(),
            stats.dead_ends.to_string(),
            format!("{:.3}", stats.corridor_share()),
            stats.unreachable_pairs.to_string(),
        ]);
    }
    table
}

fn scenario_text(scenario: &ScenarioStats) -> String {
    let ScenarioStats { num_agents, sum_of_distances, longest_distance, .. } = scenario;
    let bounds = format!(
        "{}, sum of costs at least {sum_of_distances}, makespan at least {longest_distance}",
        counted(*num_agents, "agent")
    );
    let verdict = match scenario.infeasibilities.as_slice() {
        [] if scenario.is_proven_solvable => "solvable".to_owned(),
        [] => "not proven unsolvable".to_owned(),
        infeasibilities => {
            let proofs: Vec<String> = infeasibilities.iter().map(infeasibility).collect();
            format!("unsolvable: {}", proofs.join("; "))
        }
    };
    format!("{bounds}; {verdict}")
}

fn infeasibility(infeasibility: &Infeasibility) -> String {
    let listed = |agents: &[usize]| agents.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
    match infeasibility {
        Infeasibility::NoPath(agent) => format!("agent {agent} has no path to its goal"),
        Infeasibility::SameGoal(agents, cell) => {
            format!("agents {} have the same goal, cell {cell}", listed(agents))
        }
        Infeasibility::Locked(agents) => {
            let agents = listed(agents);
            format!(
                "agents {agents} share a component, and no sequence of actions brings all of them to their goals"
            )
        }
        Infeasibility::WrongOrder(agents) => {
            let agents = listed(agents);
            format!("agents {agents} share a corridor, and their goals along it are in a different order")
        }
    }
}

fn as_json(map: &NamedMap, stats: &MapStats, scenario: Option<&ScenarioStats>) -> Value {
    json!({
        "map": map.name,
        "height": stats.height,
        "width": stats.width,
        "free": stats.num_free,
        "density": stats.density,
        "components": stats.components,
        "dead_ends": stats.dead_ends,
        "corridor_share": stats.corridor_share(),
        "unreachable_pairs": stats.unreachable_pairs,
        "scenario": scenario.map(|scenario| json!({
            "num_agents": scenario.num_agents,
            "sum_of_costs_lower_bound": scenario.sum_of_distances,
            "makespan_lower_bound": scenario.longest_distance,
            "solvable": match (scenario.infeasibilities.is_empty(), scenario.is_proven_solvable) {
                (true, true) => Some(true),
                (true, false) => None,
                (false, _) => Some(false),
            },
            "proofs": scenario.infeasibilities.iter().map(infeasibility).collect::<Vec<_>>(),
        })),
    })
}
