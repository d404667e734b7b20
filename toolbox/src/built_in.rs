//! The built-in algorithms: planners, POGEMA's own policies and learned policies.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use pogema_core::{Error, MAX_THREADS, Words};
use pogema_maps::did_you_mean;
use pogema_planners::{Budget, LifelongName, PlannerName};
use pogema_policies::{Learned, LearnedName, NamedPolicy, PolicySettings, Sampling, ShippedWeights};

use crate::suite::{Algorithm, wrong};
use crate::tree::Node;

/// All parameters of built-in algorithms.
const PARAMETERS: [&str; 11] = [
    "seed",
    "seconds",
    "nodes",
    "threads",
    "future_goals",
    "single_attempt",
    "weights",
    "sampling",
    "mask_actions",
    "expansions",
    "faithful",
];

/// The parameters that only learned policies have.
const OF_NETWORKS: [&str; 5] = ["weights", "sampling", "mask_actions", "expansions", "faithful"];

/// Parameters of pogema-toolbox's algorithms that built-in algorithms accept and ignore.
const IGNORED: [&str; 3] = ["device", "preprocessing", "run_episode_func"];

/// A built-in algorithm with its settings.
#[derive(Clone, Debug)]
pub struct BuiltIn {
    /// The name of its policy.
    pub name: String,
    /// The settings of its policy.
    pub settings: PolicySettings,
}

impl BuiltIn {
    /// Returns the built-in algorithm with the name of `algorithm`; `None` if there is none. Ignores case, and treats
    /// underscores as hyphens.
    ///
    /// # Errors
    /// One line about an unknown or unused parameter or an invalid value, or about weights that are missing or cannot
    /// be read. The path of the weights is relative to `folder`, the folder of the suite.
    pub fn of(algorithm: &Algorithm, folder: &Path) -> Option<Result<Self, Error>> {
        let name = name_of(algorithm);
        let is_known = NamedPolicy::all().iter().any(|(known, _)| *known == name);
        is_known.then(|| Self::read(name, algorithm, folder))
    }

    /// Makes its policies stop soon after any thread sets a flag.
    #[must_use]
    pub fn cancelled_by(mut self, stop: &Arc<AtomicBool>) -> Self {
        self.settings.budget.cancelled = Some(Arc::clone(stop));
        self
    }

    fn read(name: String, algorithm: &Algorithm, folder: &Path) -> Result<Self, Error> {
        let mut built_in = Self { name, settings: PolicySettings::default() };
        for (key, node) in &algorithm.parameters {
            if !OF_NETWORKS.contains(&key.as_str()) {
                built_in.set(&format!("{}.{key}", algorithm.key), key, node)?;
            }
        }
        built_in.read_network(algorithm, folder)?;
        let budget = &mut built_in.settings.budget;
        if budget.time.is_none() && budget.nodes.is_none() {
            *budget = Budget::of_time(Duration::from_secs(1));
        }
        Ok(built_in)
    }

    /// Reads the network of a learned policy, with its parameters.
    fn read_network(&mut self, algorithm: &Algorithm, folder: &Path) -> Result<(), Error> {
        let find = |key: &str| algorithm.parameters.iter().find(|(known, _)| known == key);
        let Some(name) = LearnedName::of_word(&self.name) else {
            let Some((key, node)) = OF_NETWORKS.into_iter().find_map(find) else { return Ok(()) };
            let (line, policy) = (node.line, &self.name);
            let reason = format!("line {line}: `{}.{key}`: `{policy}` has no network", algorithm.key);
            return Err(Error::Syntax { reason });
        };
        let path_of = |key: &str| format!("{}.{key}", algorithm.key);
        let mut learned = match find("weights") {
            Some((key, node)) => {
                let file = node.text().ok_or_else(|| wrong(node, &path_of(key), "the path of a network"))?;
                name.read(&folder.join(file))?
            }
            None if name.shipped_weights().is_some() => name.with_shipped_weights()?,
            None => {
                let (line, path) = (algorithm.line, path_of("weights"));
                let reason = format!("line {line}: `{path}` is missing, expected the path of a network");
                return Err(Error::Syntax { reason });
            }
        };
        let in_line = |key: &str, node: &Node, error: Error| {
            let (line, path) = (node.line, path_of(key));
            Error::Syntax { reason: format!("line {line}: `{path}`: {error}") }
        };
        if let Some((key, node)) = find("sampling") {
            let rule = node.text().and_then(Sampling::of_word);
            let rule = rule.ok_or_else(|| wrong(node, &path_of(key), &Sampling::expected()))?;
            learned = learned.with_sampling(rule).map_err(|error| in_line(key, node, error))?;
        }
        if let Some((key, node)) = find("mask_actions") {
            let flag = node.value().as_bool().ok_or_else(|| wrong(node, &path_of(key), "true or false"))?;
            learned = learned.with_masks(flag).map_err(|error| in_line(key, node, error))?;
        }
        for (key, node) in ["expansions", "faithful"].into_iter().filter_map(find) {
            learned = with_search(learned, key, node).map_err(|error| in_line(key, node, error))?;
        }
        self.settings.learned = Some(learned);
        Ok(())
    }

    fn set(&mut self, path: &str, key: &str, node: &Node) -> Result<(), Error> {
        let (value, settings) = (node.value(), &mut self.settings);
        let number = |expected: &str| value.as_u64().ok_or_else(|| wrong(node, path, expected));
        if matches!(key, "seconds" | "nodes") && !NamedPolicy::is_planner(&self.name) {
            let (line, policy) = (node.line, &self.name);
            let reason = format!("line {line}: `{path}`: `{policy}` is not a planner, so it has no budget");
            return Err(Error::Syntax { reason });
        }
        let flag = || value.as_bool().ok_or_else(|| wrong(node, path, "true or false"));
        match key {
            "seconds" => {
                let time = value.as_f64().and_then(Budget::time_from);
                settings.budget.time = Some(time.ok_or_else(|| wrong(node, path, Budget::SECONDS))?);
            }
            "nodes" => settings.budget.nodes = Some(number("a whole number of 0 or more")?),
            "seed" => {
                settings.planner.seed =
                    if value.is_null() { 0 } else { number("a whole number of 0 or more")? }
            }
            "threads" => {
                let threads = value.as_u64().filter(|threads| (1..=MAX_THREADS as u64).contains(threads));
                let expected = format!("1 to {MAX_THREADS}");
                settings.planner.threads = threads.ok_or_else(|| wrong(node, path, &expected))? as usize;
            }
            "future_goals" => {
                settings.future_goals = flag()?;
                let is_used = LifelongName::of_word(&self.name).is_some();
                return allowed(settings.future_goals, is_used, path, node, "a lifelong planner");
            }
            "single_attempt" => {
                settings.single_attempt = flag()?;
                let is_used = PlannerName::of_word(&self.name).is_some();
                return allowed(settings.single_attempt, is_used, path, node, "a one-shot planner");
            }
            ignored if IGNORED.contains(&ignored) => {}
            _ => {
                let hint = did_you_mean(key, PARAMETERS.into_iter().chain(IGNORED));
                let reason = format!("line {}: unknown parameter `{path}`{hint}", node.line);
                return Err(Error::Syntax { reason });
            }
        }
        Ok(())
    }
}

/// Returns an error if a flag is set although no policy of the algorithm uses it.
fn allowed(is_set: bool, is_used: bool, path: &str, node: &Node, user: &str) -> Result<(), Error> {
    if !is_set || is_used {
        return Ok(());
    }
    Err(wrong(node, path, &format!("false, because only {user} uses it")))
}

/// Returns the name of the policy that an algorithm names, in lower case and with hyphens for underscores; `a*` is
/// `astar`.
fn name_of(algorithm: &Algorithm) -> String {
    match algorithm.name.to_lowercase().replace('_', "-").as_str() {
        "a*" => "astar".to_owned(),
        name => name.to_owned(),
    }
}

/// The weights of an algorithm.
pub(crate) enum Weights {
    /// A file of tensors. A JSON file of the same name beside it is optional.
    File(PathBuf),
    /// The weights of crate `pogema-policies`.
    Shipped(ShippedWeights),
}

/// Returns the weights of an algorithm, if it is a learned policy and has any.
pub(crate) fn weights_of(algorithm: &Algorithm, folder: &Path) -> Option<Weights> {
    let name = LearnedName::of_word(&name_of(algorithm))?;
    match algorithm.parameters.iter().find(|(key, _)| key == "weights") {
        Some((_, node)) => node.text().map(|file| Weights::File(folder.join(file))),
        None => name.shipped_weights().map(Weights::Shipped),
    }
}

/// Sets a parameter of a search.
fn with_search(learned: Learned, key: &str, node: &Node) -> Result<Learned, Error> {
    let value = node.value();
    if key == "faithful" {
        let flag = value.as_bool();
        return learned.with_faithful(flag.ok_or_else(|| Error::argument(key, value, "true or false"))?);
    }
    let number = value.as_u64().and_then(|number| u32::try_from(number).ok());
    learned.with_expansions(number.ok_or_else(|| Error::argument(key, value, "a whole number"))?)
}
