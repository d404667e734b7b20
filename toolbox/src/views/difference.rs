//! Paired differences between two values of a varied field.

use std::collections::BTreeMap;

use pogema_core::{Error, counted};

use super::options::{Common, NUM_AGENTS, Options};
use super::pairing::Pairing;
use super::table::{Cell, Table};
use super::{Shown, known_column, known_metric, unknown_name};
use crate::bootstrap::{Estimate, RESAMPLES, Spread, mean_of};
use crate::groups::{lacking, shown};
use crate::results::{ALGORITHM, Results, Row};
use crate::tree::Node;

/// `type: difference`: how much a metric differs between two values of a varied field, on the same instances.
///
/// `field` names the field, `first` and `second` its values, and `metrics` the metrics [default: `avg_throughput`].
/// Rows of one algorithm that agree in all other varied fields form a pair. The table has a row for each folder,
/// algorithm and number of agents.
#[derive(Clone, Debug)]
pub struct DifferenceView {
    common: Common,
    field: String,
    first: String,
    second: String,
    metrics: Vec<String>,
}

/// A row of the table before it is formatted.
struct Line<'a> {
    folder: &'a str,
    algorithm: &'a str,
    /// Absent if the two values are numbers of agents.
    num_agents: Option<u64>,
    pairing: Pairing<'a>,
}

impl DifferenceView {
    pub(super) fn read(name: &str, node: &Node) -> Result<Self, Error> {
        let options = Options::new(name, node, &["field", "first", "second", "metrics"])?;
        Ok(Self {
            common: Common::read(&options)?,
            field: options.required("field")?,
            first: options.required_value("first")?,
            second: options.required_value("second")?,
            metrics: options.words("metrics")?.unwrap_or_else(|| vec!["avg_throughput".to_owned()]),
        })
    }

    /// Makes the table.
    ///
    /// # Errors
    /// If the results lack a metric, the field or one of its values.
    pub(super) fn show(&self, name: &str, results: &Results) -> Result<Shown, Error> {
        known_column(name, "field", &self.field, results)?;
        for metric in &self.metrics {
            known_metric(name, "metrics", metric, results)?;
        }
        self.check_values(name, results)?;
        let lines = self.lines(results);
        let mut notes = lacking(&results.rows, &self.metrics);
        let num_alone: usize = lines.iter().map(|line| line.pairing.alone).sum();
        if num_alone > 0 {
            let left_out = counted(num_alone, "instance");
            notes.push(format!(
                "view `{name}`: {left_out} left out, because only one of the two values has results"
            ));
        }
        Ok(Shown { tables: vec![self.table(&lines)], notes, ..Shown::default() })
    }

    /// Checks that both values occur.
    fn check_values(&self, name: &str, results: &Results) -> Result<(), Error> {
        let mut known: Vec<String> = results.rows.iter().filter_map(|row| self.value(row)).collect();
        known.sort();
        known.dedup();
        for (key, value) in [("first", &self.first), ("second", &self.second)] {
            if !known.contains(value) {
                let expected = format!("a value of `{}`", self.field);
                return Err(unknown_name(name, key, value, &expected, known.iter().map(String::as_str)));
            }
        }
        Ok(())
    }

    fn value(&self, row: &Row) -> Option<String> {
        row.settings.get(&self.field).map(shown)
    }

    fn lines<'a>(&self, results: &'a Results) -> Vec<Line<'a>> {
        let mut groups: BTreeMap<(&str, &str, Option<u64>), Vec<&Row>> = BTreeMap::new();
        for row in &results.rows {
            // The rows of a pair are in one group.
            let num_agents = (!self.compares_numbers()).then(|| row.num_agents());
            groups.entry((&row.set, &row.algorithm, num_agents)).or_default().push(row);
        }
        let line = |((folder, algorithm, num_agents), rows): ((&'a str, &'a str, _), Vec<&'a Row>)| {
            let of = |value: &str| {
                let has_value = |row: &&&Row| self.value(row).as_deref() == Some(value);
                rows.iter().filter(has_value).copied().collect::<Vec<_>>()
            };
            let pairing = Pairing::of(of(&self.first), of(&self.second), |row| self.instance_key(row));
            Line { folder, algorithm, num_agents, pairing }
        };
        groups.into_iter().map(line).collect()
    }

    /// Returns whether the two values are numbers of agents.
    fn compares_numbers(&self) -> bool {
        self.field == NUM_AGENTS
    }

    /// Returns a text that only rows of the same instance share.
    fn instance_key(&self, row: &Row) -> String {
        let others: BTreeMap<_, _> = row.settings.iter().filter(|(name, _)| **name != self.field).collect();
        serde_json::json!(others).to_string()
    }

    fn table(&self, lines: &[Line<'_>]) -> Table {
        let mut head = vec!["Folder".to_owned(), self.common.title(ALGORITHM)];
        head.extend((!self.compares_numbers()).then(|| self.common.title(NUM_AGENTS)));
        head.push("Pairs".to_owned());
        for metric in &self.metrics {
            let title = self.common.title(metric);
            head.extend([&self.first, &self.second].map(|value| format!("{title} {value}")));
            let prefix = if self.metrics.len() > 1 { format!("{title} ") } else { String::new() };
            head.extend(["difference", "%"].map(|column| format!("{prefix}{column}")));
        }
        let row = |(number, line): (usize, &Line<'_>)| {
            let mut cells =
                [line.folder.to_owned(), self.common.algorithm(line.algorithm)].map(Cell::Text).to_vec();
            cells.extend(line.num_agents.map(|number| Cell::Text(number.to_string())));
            cells.push(Cell::Count(line.pairing.pairs.len()));
            for metric in &self.metrics {
                cells.extend(figures(&line.pairing, metric, number as u64));
            }
            cells
        };
        let remark = format!(
            "`{}` minus `{}` on the same instances: mean ± half the width of its 95 % bootstrap interval \
             ({RESAMPLES} resamples of the pairs); % of the first mean",
            self.second, self.first
        );
        let rows = lines.iter().enumerate().map(|(number, line)| row((number, line))).collect();
        Table { head, rows, digits: self.common.digits, remark: Some(remark), ..Table::default() }
    }
}

/// Returns both means of a metric, their paired difference, and the difference in percent of the first mean.
fn figures(pairing: &Pairing<'_>, metric: &str, number: u64) -> [Cell; 4] {
    let both =
        pairing.pairs.iter().filter_map(|(one, other)| Some((one.metric(metric)?, other.metric(metric)?)));
    let (first, second): (Vec<f64>, Vec<f64>) = both.unzip();
    let differences: Vec<f64> = first.iter().zip(&second).map(|(one, other)| other - one).collect();
    let estimate = Estimate::of(&differences, Spread::Bootstrap { level: 95.0 }, number);
    let base = mean_of(&first).filter(|mean| *mean != 0.0);
    let percent = estimate.and_then(|estimate| Some(100.0 * estimate.mean / base?));
    [
        Cell::Number(mean_of(&first)),
        Cell::Number(mean_of(&second)),
        Cell::Mean(estimate),
        Cell::Number(percent),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::views::{Format, View};

    fn results() -> Results {
        let row = |occupancy: &str, seed: u64, throughput: f64| -> Row {
            serde_json::from_value(serde_json::json!({
                "metrics": {"avg_throughput": throughput, "ISR": 1.0},
                "env_grid_search": {"occupancy": occupancy, "num_agents": 8, "seed": seed},
                "algorithm": "A",
            }))
            .unwrap()
        };
        // The rows of the two values are in different orders, and one instance has no partner.
        let rows = vec![
            row("as_released", 0, 1.0),
            row("as_released", 1, 3.0),
            row("exact", 1, 3.5),
            row("exact", 0, 1.5),
            row("exact", 2, 9.0),
        ];
        Results { rows, notes: Vec::new() }
    }

    fn show(fields: &str) -> Result<Shown, String> {
        let view = View::read("Cost", &Node::parse(fields).unwrap());
        view.and_then(|view| view.show("Cost", &results(), None)).map_err(|error| error.to_string())
    }

    #[test]
    fn rows_of_the_same_instance_are_compared() {
        let shown = show("{type: difference, field: occupancy, first: as_released, second: exact}").unwrap();
        assert_eq!(
            shown.tables[0].text(Format::Csv).lines().collect::<Vec<_>>(),
            [
                "Folder,Algorithm,Number of Agents,Pairs,Average Throughput as_released,Average Throughput exact,\
                 difference,difference low,difference high,difference n,%",
                ",A,8,2,2,2.5,0.5,0.5,0.5,2,25",
            ]
        );
        assert_eq!(
            shown.notes,
            ["view `Cost`: 1 instance left out, because only one of the two values has results"]
        );
    }

    #[test]
    fn no_two_columns_have_the_same_title() {
        let fields = "{type: difference, field: occupancy, first: as_released, second: exact, \
            metrics: [avg_throughput, ISR]}";
        let mut titles = show(fields).unwrap().tables.remove(0).head;
        assert_eq!(titles.len(), 12);
        titles.sort();
        titles.dedup();
        assert_eq!(titles.len(), 12, "{titles:?}");
    }

    #[test]
    fn numbers_of_agents_are_compared() {
        let row = |num_agents: u64, throughput: f64| -> Row {
            serde_json::from_value(serde_json::json!({
                "metrics": {"avg_throughput": throughput},
                "env_grid_search": {"num_agents": num_agents, "seed": 0},
                "algorithm": "A",
            }))
            .unwrap()
        };
        let results = Results { rows: vec![row(8, 1.0), row(16, 1.5)], notes: Vec::new() };
        let fields = Node::parse("{type: difference, field: num_agents, first: 8, second: 16}").unwrap();
        let shown = View::read("Cost", &fields).and_then(|view| view.show("Cost", &results, None)).unwrap();
        let text = shown.tables[0].text(Format::Csv);
        assert_eq!(text.lines().nth(1), Some(",A,1,1,1.5,0.5,,,1,50"), "{text}");
        assert_eq!(shown.notes, [""; 0]);
    }

    #[test]
    fn unknown_fields_and_values_are_errors() {
        let error = |fields: &str| show(fields).unwrap_err();
        let unknown = error("{type: difference, field: occupency, first: as_released, second: exact}");
        assert!(unknown.contains("`field` is `occupency`") && unknown.contains("`occupancy`"), "{unknown}");
        let unknown = error("{type: difference, field: occupancy, first: released, second: exact}");
        assert!(unknown.contains("`first` is `released`, expected a value of `occupancy`"), "{unknown}");
        let missing = error("{type: difference, field: occupancy, first: exact}");
        assert!(missing.contains("lacks the field `second`"), "{missing}");
    }
}
