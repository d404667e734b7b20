//! Consequences of a port's claims: the requests it can play and the comparisons that apply.

use pogema_core::{OnGoal, Words, listed};
use pogema_maps::{GridConfig, Targets};
use serde::Serialize;
use serde_json::json;

use super::protocol::{Hello, Profile, ReplyKey};
use crate::request::{Op, Record, Request, Response, numbers};
use crate::rules;
use crate::tally::rules_of;

/// The form in which a port receives an episode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// An instance, where everything is already drawn.
    Instance,
    /// A config, from which the port draws the instance.
    Config,
}

/// A rule about marks that only the observations and the key `occupied` show. Moves do not depend on these marks.
const EXACT: &str = "occupancy/exact";

/// A feature that a port does not claim, and the rules that therefore stay unchecked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unclaimed {
    /// The name of the feature.
    pub what: String,
    /// A rule, or the prefix of several rules.
    pub rule: &'static str,
}

impl Unclaimed {
    pub(super) fn new(what: impl Into<String>, rule: &'static str) -> Self {
        Self { what: what.into(), rule }
    }

    /// Returns whether a rule stays unchecked.
    pub fn covers(&self, rule: &str) -> bool {
        rule.strip_prefix(self.rule).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
    }
}

/// The comparisons that apply.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Scope {
    /// Whether to compare the values that a config derives and draws.
    pub drawn: bool,
    /// Whether to compare observations.
    pub observations: bool,
    /// The names of the metrics to compare; all metrics if absent.
    pub metrics: Option<Vec<String>>,
    /// The optional keys to compare; all keys if absent.
    pub(super) tells: Option<Vec<ReplyKey>>,
}

impl Scope {
    /// All comparisons.
    pub const ALL: Self = Self { drawn: true, observations: true, metrics: None, tells: None };

    /// Returns the comparisons that apply to a port with the given claims.
    pub fn of(hello: &Hello, mode: Mode) -> Self {
        let claims = |profile| hello.profiles.contains(&profile);
        Self {
            drawn: mode == Mode::Config,
            observations: claims(Profile::Observations),
            metrics: Some(if claims(Profile::Metrics) { hello.metrics.clone() } else { Vec::new() }),
            tells: Some(hello.tells.clone()),
        }
    }

    /// Returns whether to compare an optional key.
    pub fn tells(&self, key: ReplyKey) -> bool {
        self.tells.as_ref().is_none_or(|keys| keys.contains(&key))
    }

    /// Returns whether the answer is from an engine of this workspace or POGEMA, and so is complete.
    pub fn is_whole(&self) -> bool {
        self.tells.is_none()
    }
}

/// Returns the profile that contains a rule.
pub fn profile_of(rule: &str) -> Profile {
    const SEEDING: [&str; 4] =
        ["border/noise", "goal/restart/draw", "goal/restart/foretold", "goal/restart/pool"];
    let is_any = |rules: &[&'static str]| rules.iter().any(|prefix| Unclaimed::new("", prefix).covers(rule));
    match rule.split('/').next().unwrap_or_default() {
        _ if is_any(&SEEDING) => Profile::Seeding,
        _ if rule == "seed/actions" => Profile::Policies,
        // The starts and goals of an instance are explicit.
        _ if [EXACT, "place/explicit"].contains(&rule) => Profile::Core,
        "config" | "grid" | "place" | "seed" => Profile::Seeding,
        "observe" | "border" | "occupancy" => Profile::Observations,
        "metrics" => Profile::Metrics,
        "history" => Profile::History,
        "policy" => Profile::Policies,
        _ => Profile::Core,
    }
}

/// Adapts a request to a port. Returns the adapted request and the features left out of it.
///
/// # Errors
/// The first required feature that the port does not claim.
pub fn adapt(
    hello: &Hello,
    mode: Mode,
    request: &Request,
    expected: &Response,
) -> Result<(Request, Vec<Unclaimed>), Unclaimed> {
    let config = GridConfig::from_value(&request.config);
    // An invalid config has no instance to play.
    let needs_config = config.is_err() || expected.records.is_empty();
    if mode == Mode::Config || needs_config {
        check_seeding(hello)?;
    }
    let Ok(config) = config else { return Ok((request.clone(), Vec::new())) };
    check_rules(hello, &config)?;
    check_sizes(hello, &config, expected)?;
    if mode == Mode::Instance && needs_config {
        return Ok((request.clone(), Vec::new()));
    }
    let mut request = request.clone();
    let left_out = leave_out(hello, mode, &config, &mut request, expected);
    Ok((request, left_out))
}

/// Returns an error if the port does not claim seeding; the kit sends configs only to ports that do.
fn check_seeding(hello: &Hello) -> Result<(), Unclaimed> {
    if hello.profiles.contains(&Profile::Seeding) {
        Ok(())
    } else {
        Err(Unclaimed::new("profile seeding", "config"))
    }
}

fn check_rules(hello: &Hello, config: &GridConfig) -> Result<(), Unclaimed> {
    let rules = config.rules();
    let config_rules = rules_of(config);
    check_claimed("collision", &hello.collision, rules.collision, config_rules.collide)?;
    check_claimed("on_goal", &hello.on_goal, rules.on_goal, config_rules.goal)?;
    // `leave_out` replaces an unclaimed value of these two fields with a claimed one. A port that claims no value of a
    // field cannot play the request.
    if hello.occupancy.is_empty() {
        check_claimed("occupancy", &hello.occupancy, rules.occupancy, config_rules.occupancy)?;
    }
    if hello.reward.is_empty() {
        check_claimed("reward", &hello.reward, rules.reward, config_rules.reward)?;
    }
    Ok(())
}

fn check_claimed<T: Words>(key: &str, claimed: &[T], value: T, rule: &'static str) -> Result<(), Unclaimed> {
    if claimed.contains(&value) {
        return Ok(());
    }
    Err(Unclaimed::new(format!("{key} {}", value.word()), rule))
}

fn check_sizes(hello: &Hello, config: &GridConfig, expected: &Response) -> Result<(), Unclaimed> {
    let sizes = [
        ("max_agents", config.num_agents, hello.max_agents),
        ("max_side", expected.longest_side(), hello.max_side),
        ("max_radius", config.obs_radius, hello.max_radius),
    ];
    match sizes.into_iter().find(|(_, size, max)| size > max) {
        Some((what, _, max)) => Err(Unclaimed::new(format!("{what} above {max}"), "config/limits")),
        None => Ok(()),
    }
}

/// Removes from a request the optional features that a port does not claim, and returns them.
fn leave_out(
    hello: &Hello,
    mode: Mode,
    config: &GridConfig,
    request: &mut Request,
    expected: &Response,
) -> Vec<Unclaimed> {
    let claims = |profile| hello.profiles.contains(&profile);
    let mut left_out = Vec::new();
    // If no instance can be drawn for a reset, the kit has no instance to send.
    let num_played = expected.records.len();
    if mode == Mode::Instance && matches!(request.ops.get(num_played), Some(Op::Reset(_))) {
        request.ops.truncate(num_played);
    }
    let config_rules = rules_of(config);
    if claims(Profile::Observations) {
        let unclaimed =
            check_claimed("observation", &hello.observation, config.observation_type, config_rules.observe)
                .err();
        replace_unclaimed(request, "observation_type", &hello.observation, unclaimed, &mut left_out);
    } else {
        left_out.push(Unclaimed::new("profile observations", config_rules.observe));
    }
    let unclaimed =
        check_claimed("occupancy", &hello.occupancy, config.occupancy, config_rules.occupancy).err();
    replace_unclaimed(request, "occupancy", &hello.occupancy, unclaimed, &mut left_out);
    let unclaimed = check_claimed("reward", &hello.reward, config.reward, config_rules.reward).err();
    replace_unclaimed(request, "reward", &hello.reward, unclaimed, &mut left_out);
    if mode == Mode::Instance && !config.empty_outside && !hello.noise {
        left_out.push(Unclaimed::new("noise", "border/noise"));
        request.config["empty_outside"] = true.into();
    }
    if config.persistent && !claims(Profile::History) {
        left_out.push(Unclaimed::new("profile history", "history"));
        request.config["persistent"] = false.into();
        request.ops.retain(|op| !matches!(op, Op::Back | Op::History));
    }
    let has_sequences = matches!(config.targets_xy, Some(Targets::Sequences(_)));
    if mode == Mode::Instance && config.on_target == OnGoal::Restart && !has_sequences {
        // A goal drawn again after a step back depends on the agent's cell, so no goal list can express it.
        request.ops.retain(|op| *op != Op::Back);
    }
    leave_out_metrics(hello, config, request, &mut left_out);
    let plays_policies = claims(Profile::Policies);
    if mode == Mode::Instance || !plays_policies {
        let policies = leave_out_policies(request, expected, plays_policies);
        if !plays_policies {
            left_out.extend(policies);
        }
    }
    left_out
}

/// If the value of a field is not claimed, replaces it with the first claimed one, or with the default if none is
/// claimed.
fn replace_unclaimed<T: Words + Serialize>(
    request: &mut Request,
    field: &str,
    claimed: &[T],
    unclaimed: Option<Unclaimed>,
    left_out: &mut Vec<Unclaimed>,
) {
    if let Some(unclaimed) = unclaimed {
        left_out.push(unclaimed);
        request.config[field] = json!(claimed.first().unwrap_or(&T::WORDS[0].value));
    }
}

fn leave_out_metrics(
    hello: &Hello,
    config: &GridConfig,
    request: &mut Request,
    left_out: &mut Vec<Unclaimed>,
) {
    if !hello.profiles.contains(&Profile::Metrics) {
        left_out.push(Unclaimed::new("profile metrics", rules_of(config).metrics));
        request.density = false;
        request.collisions = false;
        return;
    }
    let measures = |name: &str| hello.metrics.iter().any(|known| known == name);
    if request.density && !measures("avg_agents_density") {
        left_out.push(Unclaimed::new("metric avg_agents_density", "metrics/density"));
        request.density = false;
    }
    if request.collisions && !(measures("a_collisions") && measures("o_collisions")) {
        left_out.push(Unclaimed::new("metrics a_collisions and o_collisions", "metrics/collisions"));
        request.collisions = false;
    }
    let unclaimed = metrics_of(config.on_target).iter().copied().filter(|name| !measures(name));
    let feature = match unclaimed.collect::<Vec<_>>().as_slice() {
        [] => return,
        [one] => format!("metric {one}"),
        all => format!("metrics {}", listed(all)),
    };
    left_out.push(Unclaimed::new(feature, rules_of(config).metrics));
}

/// Returns the metrics that every episode with this value of `on_goal` has.
pub fn metrics_of(on_goal: OnGoal) -> &'static [&'static str] {
    match on_goal {
        OnGoal::Finish => &["ISR", "CSR", "ep_length"],
        OnGoal::Nothing => &["ISR", "CSR", "ep_length", "SoC", "makespan"],
        OnGoal::Restart => &["avg_throughput"],
    }
}

/// Replaces each policy operation with the actions that the policy chooses, and returns what was left out, once for
/// each policy. With `plays_astar`, replaces only the sampled actions, because their seed comes from a config.
fn leave_out_policies(request: &mut Request, expected: &Response, plays_astar: bool) -> Vec<Unclaimed> {
    // Steps back and histories may already be missing from the operations, so both sides skip them. The other records
    // match the other operations one to one, up to the first error.
    let kept =
        expected.records.iter().filter(|record| !matches!(record, Record::Back(_) | Record::History(_)));
    let mut records = kept.map(Record::step);
    let mut left_out = Vec::new();
    for op in &mut request.ops {
        if matches!(op, Op::Back | Op::History) {
            continue;
        }
        let chosen = records.next().flatten();
        let rule = match op {
            Op::Astar if !plays_astar => "policy",
            Op::Sample => "seed/actions",
            _ => continue,
        };
        let Some(step) = chosen else { continue };
        let unclaimed = Unclaimed::new("profile policies", rule);
        if !left_out.contains(&unclaimed) {
            left_out.push(unclaimed);
        }
        *op = Op::Step(numbers(&step.step.actions));
    }
    left_out
}

/// Returns a feature that the port does not claim but that a hand-written case of the rule requires, if any.
pub fn needed_by(hello: &Hello, rule: &str) -> Option<Unclaimed> {
    let profile = profile_of(rule);
    if !hello.profiles.contains(&profile) {
        let of = rules::all().map(|(name, _)| name).find(|name| *name == rule).unwrap_or_default();
        return Some(Unclaimed::new(format!("profile {profile}"), of));
    }
    let shows_marks =
        hello.profiles.contains(&Profile::Observations) || hello.tells.contains(&ReplyKey::Occupied);
    if rule == EXACT && !shows_marks {
        return Some(Unclaimed::new("profile observations, or tells occupied", EXACT));
    }
    let missing = keys_needed_by(rule).find(|(key, _)| !hello.tells.contains(key));
    missing.map(|(key, of)| Unclaimed::new(format!("tells {key}"), of))
}

/// Returns the optional keys without which a rule cannot be tested, each with the rule or the prefix of the rules about
/// this key.
pub fn keys_needed_by(rule: &str) -> impl Iterator<Item = (ReplyKey, &'static str)> {
    let needed = [
        (ReplyKey::ActionsAfter, "collide/soft/rewrite"),
        (ReplyKey::Derived, "config/size"),
        (ReplyKey::Foretold, "goal/restart/foretold"),
    ];
    needed.into_iter().filter(move |(_, of)| Unclaimed::new("", of).covers(rule))
}
