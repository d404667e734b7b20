//! The six metrics by which the POGEMA benchmark compares algorithms; higher is better.

use std::collections::{BTreeMap, HashMap, HashSet};

use pogema_core::{Words, words};
use serde_json::Value;

use crate::bootstrap::{mean, mean_of};
use crate::groups::shown;
use crate::results::{NUM_AGENTS, Results, Row};

words! {
    /// Definition of the metrics.
    #[derive(Default)]
    pub enum Definition {
        /// The definition that reproduces all published numbers from the published files.
        ///
        /// - Instances that no algorithm solved are omitted. "Best" is the best of the compared algorithms.
        /// - Scalability uses seconds per step, over all pairs of numbers of agents, and is at most 1.
        /// - If no path was found, Pathfinding uses the length of the episode as the length of the path. In lifelong
        ///   suites, an instance counts as 0 for every algorithm if any algorithm has an episode of length 0.
        /// - Coordination counts makespan − 1 steps per episode. In the published files that count collisions, this
        ///   number equals `ep_length`. In POGEMA 1.4.0, and therefore in our results, `ep_length` is larger by one.
        ///   Makespan is the same in both, so files of both kinds can be compared.
        ///
        /// Source: `build_web_plot.py` of the public repository pogema-benchmark, commit 7b86d776
        #[default]
        Published = "published",
        /// The definition in the paper's text.
        ///
        /// - An unsolved instance counts as 0, whether or not another algorithm solved it.
        /// - Scalability uses seconds and has no upper bound. All pairs count; the text leaves this open.
        /// - Pathfinding is 0 if no path was found.
        /// - Coordination counts `ep_length` steps per episode.
        ///
        /// Source: POGEMA (ICLR 2025), section 4.2, equations 1 to 9
        Paper = "paper",
    }
}

words! {
    /// One of the six metrics, in display order.
    pub enum Metric {
        /// Best sum of costs divided by the algorithm's own, on random maps and mazes.
        Performance = "Performance",
        /// The same ratio on tiles of cities.
        OutOfDistribution = "Out-of-Distribution",
        /// The same ratio on puzzles.
        Cooperation = "Cooperation",
        /// Time per agent with few agents, divided by that with more agents, in the warehouse.
        Scalability = "Scalability",
        /// One minus the rate of collisions per agent and step, on random maps and mazes.
        Coordination = "Coordination",
        /// Length of the shortest path divided by the algorithm's own, with one agent on whole cities.
        Pathfinding = "Pathfinding",
    }
}

impl Metric {
    /// Returns parts of folder names. The metric requires the folders whose names contain one of them.
    fn sets(self) -> &'static [&'static str] {
        match self {
            Self::Performance | Self::Coordination => &["random", "mazes"],
            Self::OutOfDistribution => &["movingai"],
            Self::Cooperation => &["puzzles"],
            Self::Scalability => &["warehouse"],
            Self::Pathfinding => &["pathfinding"],
        }
    }
}

/// The metrics of one algorithm.
#[derive(Clone, Debug, PartialEq)]
pub struct Six {
    /// The name of the algorithm.
    pub algorithm: String,
    /// The metrics in the order of [`Metric`]; `None` if rows are missing, lack a required metric or give no value.
    pub values: [Option<f64>; 6],
    /// Scalability without the upper bound of 1.
    pub unbounded_scalability: Option<f64>,
}

/// Length of the benchmark's lifelong episodes. The published numbers divide by it, regardless of the actual length.
const LIFELONG_STEPS: f64 = 256.0;

/// Computes the metrics of all algorithms from the folders of one evaluation.
///
/// Folders are identified by their names. An instance counts for a metric if all algorithms in the metric's folders
/// have played it. If no row of an algorithm has `a_collisions`, the algorithm counts as free of collisions. Lifelong
/// episodes are recognized by `avg_throughput`, which replaces the sum of costs there. The second result holds notes on
/// missing data, one line each.
pub fn six(results: &Results, definition: Definition) -> (Vec<Six>, Vec<String>) {
    let mut notes = Vec::new();
    let joined: Vec<Joined<'_>> =
        Metric::all().map(|metric| Joined::of(results, metric, &mut notes)).collect();
    let one = |algorithm: String| {
        let mut values = [None; 6];
        for ((metric, joined), value) in Metric::all().zip(&joined).zip(&mut values) {
            *value = joined.metric(metric, &algorithm, definition).filter(|value| value.is_finite());
        }
        let unbounded_scalability = values[3];
        if definition == Definition::Published {
            values[3] = values[3].map(|value| value.min(1.0));
        }
        Six { algorithm, values, unbounded_scalability }
    };
    let all: Vec<Six> = results.algorithms().into_iter().map(one).collect();
    for six in &all {
        for ((metric, joined), value) in Metric::all().zip(&joined).zip(&six.values) {
            if value.is_none() && !joined.instances.is_empty() {
                let algorithm = &six.algorithm;
                notes.push(format!(
                    "`{algorithm}` has no {metric}: rows are missing or lack a required metric, or give no value"
                ));
            }
        }
    }
    (all, notes)
}

/// The instances in the folders of a metric, limited to those that all algorithms in these folders have played.
struct Joined<'a> {
    instances: Vec<HashMap<&'a str, &'a Row>>,
    is_lifelong: bool,
}

impl<'a> Joined<'a> {
    fn of(results: &'a Results, metric: Metric, notes: &mut Vec<String>) -> Self {
        let sets = metric.sets();
        let is_of = |row: &&Row, set: &str| row.set.to_lowercase().contains(set);
        for set in sets {
            if !results.rows.iter().any(|row| is_of(&row, set)) {
                notes.push(format!("{metric}: no folder with `{set}` in its name"));
            }
        }
        let rows: Vec<&Row> =
            results.rows.iter().filter(|row| sets.iter().any(|set| is_of(row, set))).collect();
        let algorithms: HashSet<&str> = rows.iter().map(|row| row.algorithm.as_str()).collect();
        let mut instances: BTreeMap<String, HashMap<&str, &Row>> = BTreeMap::new();
        for &row in &rows {
            instances.entry(instance(row)).or_default().insert(&row.algorithm, row);
        }
        let all = instances.len();
        instances.retain(|_, rows| rows.len() == algorithms.len());
        if instances.len() < all {
            let left = instances.len();
            notes.push(format!(
                "{metric}: uses only the {left} of {all} instances that all algorithms have played"
            ));
        }
        let is_lifelong = rows.iter().any(|row| row.metric("avg_throughput").is_some());
        Self { instances: instances.into_values().collect(), is_lifelong }
    }

    fn metric(&self, metric: Metric, algorithm: &str, definition: Definition) -> Option<f64> {
        match metric {
            Metric::Performance | Metric::OutOfDistribution | Metric::Cooperation => {
                self.ratio(algorithm, definition)
            }
            Metric::Scalability => self.scalability(algorithm, definition),
            Metric::Coordination => self.coordination(algorithm, definition),
            Metric::Pathfinding => self.pathfinding(algorithm, definition),
        }
    }

    /// Returns the mean of a value over all instances that count; `None` if the value is unknown for any instance.
    fn mean(&self, figure: impl Fn(&HashMap<&str, &Row>) -> Option<Counted>) -> Option<f64> {
        let found: Option<Vec<Counted>> = self.instances.iter().map(figure).collect();
        mean_of(&found?.into_iter().flatten().collect::<Vec<f64>>())
    }

    /// Computes the mean, over the instances, of the best sum of costs divided by the algorithm's own. In the lifelong
    /// setting, it is the mean of the algorithm's throughput divided by the best.
    fn ratio(&self, algorithm: &str, definition: Definition) -> Option<f64> {
        let unsolved = (definition == Definition::Paper).then_some(0.0);
        self.mean(|rows| {
            let own = rows.get(algorithm)?;
            if self.is_lifelong {
                let all: Option<Vec<f64>> = rows.values().map(|row| row.metric("avg_throughput")).collect();
                let best = all?.into_iter().fold(0.0, f64::max);
                return Some(if best > 0.0 { Some(own.metric("avg_throughput")? / best) } else { unsolved });
            }
            let Some(best) = least(rows, "SoC")? else { return Some(unsolved) };
            Some(Some(solved(own, "SoC")?.map_or(0.0, |cost| best / cost)))
        })
    }

    fn scalability(&self, algorithm: &str, definition: Definition) -> Option<f64> {
        let mut times: BTreeMap<u64, Vec<f64>> = BTreeMap::new();
        for rows in &self.instances {
            let row = rows.get(algorithm)?;
            let is_per_step = definition == Definition::Published && !self.is_lifelong;
            let steps = if is_per_step { row.metric("makespan")? } else { 1.0 };
            let num_agents = row.field(NUM_AGENTS)?.as_u64()?;
            times.entry(num_agents).or_default().push(row.metric("runtime")? / steps);
        }
        let per_agent: Vec<f64> = times.iter().map(|(&number, times)| mean(times) / number as f64).collect();
        let pairs =
            (0..per_agent.len()).flat_map(|at| per_agent[at + 1..].iter().map(move |many| (at, many)));
        mean_of(&pairs.map(|(few, many)| per_agent[few] / many).collect::<Vec<f64>>())
    }

    fn coordination(&self, algorithm: &str, definition: Definition) -> Option<f64> {
        let collisions = |row: &Row| Some(row.metric("a_collisions")? + row.metric("o_collisions")?);
        let mut own = self.instances.iter().filter_map(|rows| rows.get(algorithm)).peekable();
        own.peek()?;
        if own.all(|row| row.metrics.get("a_collisions").is_none()) {
            return Some(1.0);
        }
        let mean = self.mean(|rows| {
            let row = rows.get(algorithm)?;
            let num_agents = row.field(NUM_AGENTS)?.as_f64()?;
            let steps = match definition {
                Definition::Published if self.is_lifelong => LIFELONG_STEPS,
                // An episode of one step would otherwise divide by zero.
                Definition::Published => (row.metric("makespan")? - 1.0).max(1.0),
                Definition::Paper if self.is_lifelong => row.metric("ep_length").unwrap_or(LIFELONG_STEPS),
                Definition::Paper => row.metric("ep_length")?.max(1.0),
            };
            Some(Some(collisions(row)? / (steps * num_agents)))
        });
        mean.map(|share| 1.0 - share)
    }

    fn pathfinding(&self, algorithm: &str, definition: Definition) -> Option<f64> {
        let length =
            if self.is_lifelong && definition == Definition::Published { "ep_length" } else { "makespan" };
        self.mean(|rows| {
            let own = rows.get(algorithm)?;
            if definition == Definition::Paper {
                let best = least(rows, length)?;
                return Some(Some(solved(own, length)?.zip(best).map_or(0.0, |(cost, best)| best / cost)));
            }
            let lengths: Option<Vec<f64>> = rows.values().map(|row| row.metric(length)).collect();
            let best = lengths?.into_iter().reduce(f64::min)?;
            let own = own.metric(length)?;
            Some(Some(if own > 0.0 { best / own } else { 0.0 }))
        })
    }
}

/// A value, or `None` if the instance does not count.
type Counted = Option<f64>;

/// Returns a metric of a row; `Some(None)` if the row is not solved; `None` if `CSR`, or the metric of a solved row, is
/// unknown.
fn solved(row: &Row, metric: &str) -> Option<Counted> {
    Some(if row.metric("CSR")? > 0.0 { Some(row.metric(metric)?) } else { None })
}

/// Returns the minimum of a metric over the solved rows; `None` if [`solved`] returns `None` for any row.
fn least(rows: &HashMap<&str, &Row>, metric: &str) -> Option<Counted> {
    let all: Option<Vec<Counted>> = rows.values().map(|row| solved(row, metric)).collect();
    Some(all?.into_iter().flatten().reduce(f64::min))
}

/// Returns a text that identifies an instance: its folder and all varied fields, sorted by name.
pub(crate) fn instance(row: &Row) -> String {
    let mut settings: Vec<(&String, &Value)> = row.settings.iter().collect();
    settings.sort_by(|one, other| one.0.cmp(other.0));
    let settings = settings.into_iter().map(|(name, value)| format!("{name}={}", shown(value)));
    std::iter::once(row.set.clone()).chain(settings).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(set: &str, algorithm: &str, seed: u64, metrics: &str) -> Row {
        let settings = format!("{{\"num_agents\": 2, \"seed\": {seed}}}");
        let text = format!(
            "{{\"metrics\": {metrics}, \"env_grid_search\": {settings}, \"algorithm\": \"{algorithm}\"}}"
        );
        Row { set: set.to_owned(), ..serde_json::from_str(&text).unwrap() }
    }

    fn of(rows: Vec<Row>, definition: Definition) -> (Vec<Six>, Vec<String>) {
        six(&Results { rows, notes: Vec::new() }, definition)
    }

    #[test]
    fn instances_without_a_solution_are_left_out_or_count_as_zero() {
        let metrics = [r#"{"CSR": 1, "SoC": 4}"#, r#"{"CSR": 1, "SoC": 8}"#, r#"{"CSR": 0, "SoC": 9}"#];
        let rows = || {
            let of_seed = |seed, one: usize, other: usize| {
                [row("05-puzzles", "A", seed, metrics[one]), row("05-puzzles", "B", seed, metrics[other])]
            };
            [of_seed(0, 0, 1), of_seed(1, 2, 2)].into_iter().flatten().collect::<Vec<_>>()
        };
        let cooperation =
            |definition| of(rows(), definition).0.iter().map(|six| six.values[2]).collect::<Vec<_>>();
        assert_eq!(cooperation(Definition::Published), [Some(1.0), Some(0.5)]);
        assert_eq!(cooperation(Definition::Paper), [Some(0.5), Some(0.25)]);
        let (_, notes) = of(rows(), Definition::Published);
        assert!(
            notes.contains(&"Scalability: no folder with `warehouse` in its name".to_owned()),
            "{notes:?}"
        );
    }

    #[test]
    fn a_number_of_agents_that_is_not_varied_is_read_from_the_config() {
        let metrics = r#"{"ep_length": 10, "makespan": 11, "a_collisions": 3, "o_collisions": 2}"#;
        let fixed = |set| {
            let mut row = row(set, "A", 0, metrics);
            let num_agents = row.settings.shift_remove("num_agents").unwrap();
            row.config = serde_json::from_value(serde_json::json!({"num_agents": num_agents})).unwrap();
            row
        };
        let (six, _) = of(vec![fixed("01-random"), fixed("02-mazes")], Definition::Published);
        assert_eq!(six[0].values[4], Some(0.75));
    }

    #[test]
    fn coordination_is_the_same_for_both_counts_of_steps() {
        let coordination = |ep_length: u64, definition| {
            let metrics = format!(
                r#"{{"ep_length": {ep_length}, "makespan": 11, "a_collisions": 3, "o_collisions": 2}}"#
            );
            of(vec![row("01-random", "A", 0, &metrics), row("02-mazes", "A", 0, &metrics)], definition).0[0]
                .values[4]
        };
        // `ep_length` as in the published files, then as in POGEMA 1.4.0.
        assert_eq!(coordination(10, Definition::Published), Some(0.75));
        assert_eq!(coordination(11, Definition::Published), Some(0.75));
        assert_eq!(coordination(10, Definition::Paper), Some(0.75));
    }

    #[test]
    fn a_lifelong_episode_of_length_0_counts_0_in_pathfinding_for_every_algorithm() {
        let lifelong = |algorithm, seed, ep_length: u64| {
            let metrics = format!(r#"{{"avg_throughput": 0.5, "ep_length": {ep_length}}}"#);
            row("06-pathfinding", algorithm, seed, &metrics)
        };
        // On seed 1, only B has an episode of length 0; on seed 2, both do.
        let lengths = [
            ("A", 0, 10),
            ("B", 0, 20),
            ("A", 1, 4),
            ("B", 1, 0),
            ("A", 2, 0),
            ("B", 2, 0),
            ("A", 3, 6),
            ("B", 3, 6),
        ];
        let rows = lengths.map(|(algorithm, seed, length)| lifelong(algorithm, seed, length)).to_vec();
        let (all, _) = of(rows, Definition::Published);
        assert_eq!(all.iter().map(|six| six.values[5]).collect::<Vec<_>>(), [Some(0.5), Some(0.375)]);
    }

    #[test]
    fn instances_missing_for_an_algorithm_are_noted() {
        let metrics = r#"{"avg_throughput": 0.5}"#;
        let rows = vec![
            row("04-movingai", "A", 0, metrics),
            row("04-movingai", "A", 1, metrics),
            row("04-movingai", "B", 0, r#"{"avg_throughput": 1.0}"#),
        ];
        let (all, notes) = of(rows, Definition::Published);
        assert_eq!(all.iter().map(|six| six.values[1]).collect::<Vec<_>>(), [Some(0.5), Some(1.0)]);
        let note = "Out-of-Distribution: uses only the 1 of 2 instances that all algorithms have played";
        assert!(notes.contains(&note.to_owned()), "{notes:?}");
    }
}
