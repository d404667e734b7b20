//! How long planners take that are to be quick.

use std::time::{Duration, Instant};

use comfy_table::Table;
use pogema_core::Error;
use pogema_maps::formats::NamedMap;
use pogema_maps::{GridConfig, InstanceSource};
use pogema_planners::{
    Budget, Graph, Lacam, LacamParams, Lifelong, PibtLifelong, PibtParams, Planner, Problem, validate,
};

use crate::output::markdown_table;

use super::suite::{Set, Setting, Task};

/// The times of some runs.
#[derive(Default)]
struct Times(Vec<Duration>);

impl Times {
    fn median(&mut self) -> Duration {
        self.0.sort_unstable();
        self.0.get(self.0.len() / 2).copied().unwrap_or_default()
    }

    fn longest(&self) -> Duration {
        self.0.iter().max().copied().unwrap_or_default()
    }
}

/// A set, its maps and how many agents are put on each of them.
pub struct Crowds<'a> {
    pub set: &'a Set,
    pub maps: Vec<NamedMap>,
    pub num_agents: usize,
}

impl Crowds<'_> {
    fn configs(&self, setting: Setting, every: usize) -> Result<Vec<GridConfig>, Error> {
        let task = |map: &NamedMap| Task {
            set: self.set.name,
            num_agents: self.num_agents,
            map: map.name.clone(),
            seed: 0,
        };
        let tasks = self.maps.iter().step_by(every).map(task);
        tasks.map(|task| self.set.config(setting, &task, &self.maps)).collect()
    }
}

/// The table: first plans on crowded and on large maps, and steps of PIBT.
pub fn table(
    squares: &Crowds<'_>,
    cities: &Crowds<'_>,
    halls: &Crowds<'_>,
    every: usize,
) -> Result<Table, Error> {
    let mut table = markdown_table(&["work", "runs", "median", "longest", "bar"]);
    let milliseconds = |time: Duration| format!("{:.1} ms", time.as_secs_f64() * 1e3);
    for (crowds, bar) in [(squares, "20 ms"), (cities, "1 s")] {
        let mut times = Times::default();
        for config in crowds.configs(Setting::Mapf, every)? {
            times.0.extend(first_plan(&config)?);
        }
        let work = format!("first plan of lacam, {}, {} agents", crowds.set.name, crowds.num_agents);
        let (runs, longest) = (times.0.len().to_string(), milliseconds(times.longest()));
        table.add_row([work, runs, milliseconds(times.median()), longest, bar.to_owned()]);
    }
    let mut times = Times::default();
    for config in halls.configs(Setting::Lmapf, 1)? {
        for _ in 0..5 {
            times.0.push(walk(&config)?);
        }
    }
    let rate = |time: Duration| format!("{:.2} M/s", halls.num_agents as f64 / time.as_secs_f64() / 1e6);
    let work = format!("agent-steps of pibt, {}, {} agents", halls.set.name, halls.num_agents);
    let (runs, longest) = (times.0.len().to_string(), rate(times.longest()));
    table.add_row([work, runs, rate(times.median()), longest, "2 M/s".to_owned()]);
    Ok(table)
}

/// Time until the first plan of an instance, which is then checked; none if there is no plan.
fn first_plan(config: &GridConfig) -> Result<Option<Duration>, Error> {
    let instance = InstanceSource::new(config.clone(), None)?.generate()?.instance;
    let problem = Problem::of(&instance)?;
    let mut planner = Lacam::new(LacamParams { refine: false, ..LacamParams::default() });
    let began = Instant::now();
    let outcome = planner.plan(&problem, &Budget::of_time(Duration::from_secs(60)));
    let time = began.elapsed();
    let Some(plan) = outcome.solution() else { return Ok(None) };
    validate(instance.map(), instance.starts(), Some(&instance.first_goals()), plan)
        .map_err(|conflict| Error::Plan { reason: format!("a plan is wrong: {conflict}") })?;
    Ok(Some(time))
}

/// Time of a mean step of PIBT, costs to go included.
fn walk(config: &GridConfig) -> Result<Duration, Error> {
    let instance = InstanceSource::new(config.clone(), None)?.generate()?.instance;
    let graph = std::sync::Arc::new(Graph::new(instance.map()));
    let mut streams = instance.goals().to_vec();
    let mut now = graph.vertices_of("start", instance.starts())?;
    let mut goals = graph.vertices_of("goal", &instance.first_goals())?;
    let mut pibt = PibtLifelong::new(graph.clone(), PibtParams::default());
    let num_steps = u32::try_from(config.max_episode_steps).unwrap_or(u32::MAX).max(1);
    let mut time = Duration::ZERO;
    for _ in 0..num_steps {
        let began = Instant::now();
        now = pibt.next(&now, &goals, &Budget::default())?;
        time += began.elapsed();
        for ((&place, goal), stream) in now.iter().zip(&mut goals).zip(&mut streams) {
            if place == *goal {
                *goal = graph.vertices_of("goal", &[stream.advance(graph.cell(place))])?[0];
            }
        }
    }
    Ok(time / num_steps)
}
