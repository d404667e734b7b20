//! Plans with LaCAM*, checks the plan, plays it and writes a page that replays it.

use pogema::planners::{Budget, PlannerName, PlannerSettings, Problem, validate};
use pogema::{Engine, Episode, Error, GridConfig, InstanceSource, render::html};

pub(crate) fn main() -> Result<(), Error> {
    let text = "{size: 16, num_agents: 12, seed: 5, on_target: nothing, collision_system: soft}";
    let config = GridConfig::from_yaml(text)?;
    let instance = InstanceSource::new(config.clone(), None)?.generate()?.instance;
    let mut lacam = PlannerName::Lacam.make(PlannerSettings::default());
    let outcome = lacam.plan(&Problem::of(&instance)?, &Budget::of_nodes(5_000));
    let plan = outcome.solution().ok_or_else(|| Error::instance("LaCAM* found no plan"))?;
    let goals = instance.first_goals();
    let checked = validate(instance.map(), instance.starts(), Some(&goals), plan);
    checked.map_err(|conflict| Error::instance(conflict.to_string()))?;

    let mut episode = Episode::new(Engine::new(config.rules())?).with_recording();
    episode.start(instance)?;
    for step in 0..plan.num_steps() {
        episode.step(&plan.actions(step)?)?;
    }
    assert!(episode.is_over(), "an agent is not on its goal after the plan");
    let page = html::replay(&episode.trace()?, "Planned by LaCAM*")?;
    let path = std::env::temp_dir().join(format!("pogema-plan-{}.html", std::process::id()));
    std::fs::write(&path, page).map_err(|error| Error::io(&path, error))?;
    println!("sum of costs {}, replay in {}", plan.sum_of_costs(), path.display());
    Ok(())
}
