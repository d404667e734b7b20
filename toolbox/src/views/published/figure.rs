//! The mean of one metric beside the published one.

use crate::bootstrap::mean;
use crate::frame::values;
use crate::results::Row;
use crate::views::pairing::{Pairing, is_solved};

/// The share of solved instances.
pub(super) const SOLVED: &str = "CSR";

/// The metric that is compared on solved instances alone.
pub(super) const COST: &str = "SoC";

/// The metric whose maximum is shown, too.
pub(super) const RUNTIME: &str = "runtime";

/// The means of one metric.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Figure {
    pub ours: Option<f64>,
    pub published: Option<f64>,
    /// A lower bound on the ratio of any planner.
    pub at_least: Option<f64>,
}

impl Figure {
    /// The mean of a metric over all rows.
    pub fn of_all(rows: &[&Row], metric: &str, published: Option<f64>) -> Self {
        Self { ours: mean_of(&values(rows, metric)), published, at_least: None }
    }

    /// The mean costs of the instances that both solve. The bound counts all instances that the published one solves.
    pub fn of_both_solved(pairing: &Pairing<'_>) -> Self {
        let means = |cost: fn(&Row) -> Option<f64>| {
            let solved = pairing.pairs.iter().filter(|(_, published)| is_solved(published));
            let (ours, published): (Vec<f64>, Vec<f64>) =
                solved.filter_map(|(row, published)| Some((cost(row)?, published.metric(COST)?))).unzip();
            (mean_of(&ours), mean_of(&published))
        };
        let ((ours, published), (bound, bounded)) = (means(solved_cost), means(lower_bound));
        Self { ours, published, at_least: ratio(bound, bounded) }
    }

    /// The mean cost of the solved instances, beside a published mean over all of them.
    pub fn of_all_solved(rows: &[&Row], published: Option<f64>) -> Self {
        let costs: Vec<f64> = rows.iter().filter_map(|row| solved_cost(row)).collect();
        let bounds: Vec<f64> = rows.iter().filter_map(|row| lower_bound(row)).collect();
        let is_whole = |figures: &[f64]| figures.len() == rows.len();
        Self {
            ours: mean_of(&costs),
            published: published.filter(|_| is_whole(&costs)),
            at_least: ratio(mean_of(&bounds).filter(|_| is_whole(&bounds)), published),
        }
    }

    /// Our mean over the published one.
    pub fn ratio(&self) -> Option<f64> {
        ratio(self.ours, self.published)
    }
}

fn solved_cost(row: &Row) -> Option<f64> {
    row.metric(COST).filter(|_| is_solved(row))
}

fn lower_bound(row: &Row) -> Option<f64> {
    row.proof.lower_bound.map(|bound| bound as f64)
}

fn mean_of(figures: &[f64]) -> Option<f64> {
    (!figures.is_empty()).then(|| mean(figures))
}

fn ratio(ours: Option<f64>, published: Option<f64>) -> Option<f64> {
    let published = published.filter(|&published| published != 0.0)?;
    Some(ours? / published)
}
