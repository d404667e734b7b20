//! The worst and the best episodes of each algorithm.

use std::collections::HashMap;

use indexmap::IndexMap;

use crate::results::{Pairs, Results, Row, is_higher_better, short};

/// Metrics that rank episodes. The first one that all rows have is used.
const RANKED_BY: [&str; 4] = ["avg_throughput", "SoC", "makespan", "ep_length"];

/// The share of agents that reached their goals. It ranks before any other metric.
const ISR: &str = "ISR";

/// An episode chosen for display.
#[derive(Clone, Debug, PartialEq)]
pub struct Pick {
    /// Its algorithm.
    pub algorithm: String,
    /// Its index among the rows of the algorithm.
    pub episode: usize,
    /// Index of its row among all rows.
    pub row: usize,
    /// Whether it is one of the worst rather than one of the best.
    pub is_worst: bool,
    /// The metric that ranks it.
    pub by: String,
    /// The metrics that rank it, as a short text.
    pub why: String,
}

/// Returns the `number` worst episodes of each algorithm, worst first, then the same number of its best episodes.
///
/// Episodes are ranked by three criteria: the share of agents that reached their goals; the ratio of the metric to that
/// of the best algorithm in the same environment; the metric itself. If no ranking metric is common to all rows, the
/// result is empty.
pub fn picks(results: &Results, number: usize) -> Vec<Pick> {
    let Some(metric) = ranking_metric(results) else { return Vec::new() };
    let is_lower_better = !is_higher_better(metric);
    let best = best_of(results, metric, is_lower_better);
    let mut of_algorithms: IndexMap<&str, Vec<Ranked>> = IndexMap::new();
    for (at, row) in results.rows.iter().enumerate() {
        let name = row.algorithm.as_str();
        let episodes = of_algorithms.entry(name).or_default();
        let value = row.metric(metric).unwrap_or_default();
        let (best_value, winner) = best.get(&environment(&row.settings)).copied().unwrap_or((value, name));
        let ratio = if is_lower_better { value / best_value } else { best_value / value };
        let ratio = if ratio.is_nan() { 1.0 } else { ratio };
        let solved = row.metric(ISR);
        let why =
            why(metric, value, solved, value / best_value, (winner != name && ratio > 1.0).then_some(winner));
        let cost = if is_lower_better { value } else { -value };
        let badness = [-solved.unwrap_or(1.0), ratio, cost];
        let by = if solved.is_some_and(|share| share < 1.0) { ISR } else { metric };
        let (algorithm, by) = (name.into(), by.into());
        let pick = Pick { algorithm, episode: episodes.len(), row: at, is_worst: true, by, why };
        episodes.push(Ranked { pick, badness });
    }
    of_algorithms.into_values().flat_map(|episodes| ends(episodes, number)).collect()
}

/// Returns the metric that ranks the episodes.
fn ranking_metric(results: &Results) -> Option<&'static str> {
    RANKED_BY.into_iter().find(|name| results.rows.iter().all(|row| row.metric(name).is_some()))
}

/// Returns a sentence about the ranking of the episodes; `None` if no metric ranks them.
pub(super) fn ranking(results: &Results) -> Option<String> {
    let metric = ranking_metric(results)?;
    let better = if is_higher_better(metric) { "higher" } else { "lower" };
    let has_share = results.rows.iter().any(|row| row.metric(ISR).is_some());
    let first = if has_share { format!("{ISR} (higher is better), then by ") } else { String::new() };
    Some(format!(
        "Episodes are ranked by {first}{metric} ({better} is better) relative to the best algorithm in the same \
         environment, then by {metric} itself."
    ))
}

struct Ranked {
    pick: Pick,
    /// Criteria in order of precedence; larger is worse.
    badness: [f64; 3],
}

/// Returns the best value of a metric in each environment, and the algorithm that reached it.
fn best_of<'a>(results: &'a Results, metric: &str, is_lower_better: bool) -> HashMap<String, (f64, &'a str)> {
    let mut best: HashMap<String, (f64, &str)> = HashMap::new();
    // An episode in which agents miss their goals may cost less than one in which all of them arrive.
    let is_solved = |row: &&Row| row.metric(ISR).is_none_or(|share| share >= 1.0);
    for row in results.rows.iter().filter(is_solved) {
        let value = row.metric(metric).unwrap_or_default();
        let place = best.entry(environment(&row.settings)).or_insert((value, &row.algorithm));
        if if is_lower_better { value < place.0 } else { value > place.0 } {
            *place = (value, &row.algorithm);
        }
    }
    best
}

fn why(metric: &str, value: f64, solved: Option<f64>, ratio: f64, winner: Option<&str>) -> String {
    let ratio = winner.map_or_else(String::new, |winner| format!(" ({ratio:.2} × that of {winner})"));
    let solved = solved.map_or_else(String::new, |share| format!(", {ISR} {}", short(share)));
    format!("{metric} {}{ratio}{solved}", short(value))
}

/// Returns a text that identifies an environment, regardless of the order of its settings.
fn environment(settings: &Pairs) -> String {
    let mut parts: Vec<String> = settings.iter().map(|(name, value)| format!("{name}={value}")).collect();
    parts.sort();
    parts.join("\n")
}

fn ends(mut episodes: Vec<Ranked>, number: usize) -> Vec<Pick> {
    let worst_first = |one: &Ranked, other: &Ranked| {
        let pairs = one.badness.iter().zip(&other.badness);
        let differs = pairs.map(|(one, other)| other.total_cmp(one)).find(|order| order.is_ne());
        differs.unwrap_or_else(|| one.pick.episode.cmp(&other.pick.episode))
    };
    episodes.sort_by(worst_first);
    let worst = episodes.iter().take(number).map(|ranked| ranked.pick.clone());
    let best =
        episodes.iter().rev().take(number).map(|ranked| Pick { is_worst: false, ..ranked.pick.clone() });
    worst.chain(best).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn results(rows: &[(&str, u64, f64, f64)]) -> Results {
        let row = |&(algorithm, seed, soc, share): &(&str, u64, f64, f64)| Row {
            metrics: Pairs::from([("SoC".into(), soc.into()), ("ISR".into(), share.into())]),
            settings: Pairs::from([("seed".into(), seed.into())]),
            algorithm: algorithm.to_owned(),
            ..Row::default()
        };
        Results { rows: rows.iter().map(row).collect(), notes: Vec::new() }
    }

    #[test]
    fn unsolved_episodes_are_worst_then_those_solved_better_by_another() {
        let rows = [("A", 0, 20.0, 1.0), ("A", 1, 12.0, 1.0), ("A", 2, 5.0, 0.5), ("A", 3, 50.0, 1.0)];
        let of_b = [("B", 0, 10.0, 1.0), ("B", 1, 12.0, 1.0), ("B", 2, 40.0, 1.0), ("B", 3, 50.0, 1.0)];
        let picks = picks(&results(&[rows, of_b].concat()), 2);
        let found: Vec<_> =
            picks.iter().map(|pick| (pick.algorithm.as_str(), pick.episode, pick.is_worst)).collect();
        let of_a = [("A", 2, true), ("A", 0, true), ("A", 1, false), ("A", 3, false)];
        // No algorithm did better than B, so B's own costs decide.
        let of_b = [("B", 3, true), ("B", 2, true), ("B", 0, false), ("B", 1, false)];
        assert_eq!(found, [of_a, of_b].concat());
        assert_eq!(picks[1].why, "SoC 20 (2.00 × that of B), ISR 1");
        assert_eq!(picks[0].why, "SoC 5, ISR 0.5");
        assert_eq!([picks[0].by.as_str(), picks[1].by.as_str()], ["ISR", "SoC"]);
        assert_eq!((picks[4].row, picks[5].row), (7, 6));
    }

    #[test]
    fn rows_without_a_ranking_metric_are_not_picked() {
        let mut results = results(&[("A", 0, 20.0, 1.0)]);
        results.rows[0].metrics = Pairs::from([("fun".into(), 1.0.into())]);
        assert_eq!(picks(&results, 3), []);
    }
}
