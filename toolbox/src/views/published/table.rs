//! The table of means beside published ones.

use super::figure::{Figure, RUNTIME, SOLVED};
use super::set::NUM_AGENTS;
use crate::views::grid::{Cell, Table};
use crate::views::options::Common;

/// The metrics that are shown like ratios.
const SHARES: [&str; 2] = [SOLVED, "ISR"];

/// A row of the table before it is text.
pub(super) struct Line<'a> {
    pub folder: &'a str,
    pub num_agents: u64,
    pub num_episodes: usize,
    /// In the order of the metrics.
    pub figures: Vec<Figure>,
    /// The longest run time.
    pub longest: Option<f64>,
}

/// A column: its title and its cells.
type Column = (String, Vec<Cell>);

/// Makes the table; columns that would be empty are left out.
pub(super) fn table(common: &Common, metrics: &[String], lines: &[Line<'_>], remark: String) -> Table {
    let column = |title: &str, cell: &dyn Fn(&Line<'_>) -> Cell| -> Column {
        (title.to_owned(), lines.iter().map(cell).collect())
    };
    let mut columns = Vec::new();
    if lines.windows(2).any(|pair| pair[0].folder != pair[1].folder) {
        columns.push(column("Folder", &|line| Cell::Text(line.folder.to_owned())));
    }
    columns.push(column(&common.title(NUM_AGENTS), &|line| Cell::Count(line.num_agents as usize)));
    columns.push(column("Episodes", &|line| Cell::Count(line.num_episodes)));
    for (at, metric) in metrics.iter().enumerate() {
        let figures: Vec<Figure> = lines.iter().map(|line| line.figures[at]).collect();
        columns.extend(of_metric(&common.title(metric), SHARES.contains(&metric.as_str()), &figures));
        if metric == RUNTIME {
            columns.push(column("longest", &|line| Cell::Number(line.longest)));
        }
    }
    let row = |at: usize| columns.iter().map(|(_, cells)| cells[at].clone()).collect();
    Table {
        rows: (0..lines.len()).map(row).collect(),
        head: columns.iter().map(|(title, _)| title.clone()).collect(),
        digits: common.digits,
        remark: Some(remark),
        ..Table::default()
    }
}

/// The columns of one metric.
fn of_metric(title: &str, is_share: bool, figures: &[Figure]) -> Vec<Column> {
    let ratio = |get: &dyn Fn(&Figure) -> Option<f64>| figures.iter().map(get).map(Cell::Ratio).collect();
    let number = |get: &dyn Fn(&Figure) -> Option<f64>| {
        if is_share { ratio(get) } else { figures.iter().map(get).map(Cell::Number).collect() }
    };
    let mut columns: Vec<Column> = vec![(title.to_owned(), number(&|figure| figure.ours))];
    if figures.iter().any(|figure| figure.published.is_some()) {
        columns.push((format!("{title} published"), number(&|figure| figure.published)));
        columns.push((format!("{title} ratio"), ratio(&Figure::ratio)));
    }
    if figures.iter().any(|figure| figure.at_least.is_some()) {
        columns.push((format!("{title} at least"), ratio(&|figure| figure.at_least)));
    }
    columns
}
