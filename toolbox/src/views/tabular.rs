//! Tables of means.

use pogema_core::Error;

use super::options::{Common, Options};
use super::table::{Cell, Format, Table};
use super::{Shown, decisions, unknown_name};
use crate::bootstrap::{Estimate, RESAMPLES, Spread};
use crate::groups::{Group, compare, group_by, lacking, values};
use crate::results::{NETWORK_TIME, RUNTIME, Results};
use crate::tree::Node;

/// The values of `table_format` that select each of our formats: pogema-toolbox's names, and our own.
///
/// Source: tabulate 0.9, `tabulate_formats`
const FORMATS: [(Format, &str); 5] = [
    (
        Format::Terminal,
        "psql plain simple grid simple_grid rounded_grid heavy_grid mixed_grid double_grid fancy_grid outline \
         simple_outline rounded_outline heavy_outline mixed_outline double_outline fancy_outline presto pretty \
         orgtbl rst terminal",
    ),
    (Format::Markdown, "github pipe markdown"),
    (Format::Latex, "latex latex_raw latex_booktabs latex_longtable"),
    (Format::Csv, "csv"),
    (Format::Tsv, "tsv"),
];

/// `type: tabular`: the mean of each metric in each group of rows.
///
/// Rows with equal values in all columns except metrics and `drop_keys` form a group. Metrics are in the order of their
/// first appearance in any row; pogema-toolbox takes only those of the first row, and groups by the others.
///
/// With `decision_times`, the planner's and the network's time for one action of one agent replace the run times of
/// episodes.
///
/// Source: pogema-toolbox 0.1.1, `view_tabular.py`
#[derive(Clone, Debug)]
pub struct TableView {
    common: Common,
    spread: Spread,
    skips_zero: bool,
    shows_decisions: bool,
    /// The format that the view requests.
    pub(super) format: Format,
}

impl TableView {
    pub(super) fn read(name: &str, node: &Node) -> Result<Self, Error> {
        let known = [
            "print_results",
            "table_format",
            "show_std",
            "skip_zero_std",
            "error_method",
            "error_level",
            "decision_times",
        ];
        let options = Options::new(name, node, &known)?;
        // Checked but ignored: the table is always shown.
        options.flag("print_results")?;
        let words: Vec<&'static str> = FORMATS.iter().flat_map(|(_, words)| words.split(' ')).collect();
        let word = options.choice("table_format", &words)?.unwrap_or("psql");
        let format = FORMATS.iter().find(|(_, words)| words.split(' ').any(|known| known == word));
        let method = options.choice("error_method", &["ci", "sd"])?.unwrap_or("ci");
        let level = options.size("error_level")?;
        let spread = match method {
            _ if options.flag("show_std")? == Some(false) => Spread::None,
            "sd" => Spread::Deviation { factor: level.unwrap_or(1.96) },
            _ => Spread::Bootstrap { level: level.unwrap_or(95.0) },
        };
        if matches!(spread, Spread::Bootstrap { level } if level > 100.0) {
            return Err(options.reject("error_level", "a percentage of at most 100"));
        }
        Ok(Self {
            common: Common::read(&options)?,
            spread,
            skips_zero: options.flag("skip_zero_std")?.unwrap_or(false),
            shows_decisions: options.flag("decision_times")?.unwrap_or(false),
            format: format.map_or(Format::Terminal, |(format, _)| *format),
        })
    }

    /// Makes the table.
    ///
    /// # Errors
    /// If `sort_by` names a column that the table lacks.
    pub(super) fn show(&self, name: &str, results: &Results) -> Result<Shown, Error> {
        let kept = |columns: Vec<String>| -> Vec<String> {
            columns.into_iter().filter(|column| !self.common.drop_keys.contains(column)).collect()
        };
        let (keys, metrics) = (kept(results.key_columns()), kept(results.metric_columns()));
        let keys: Vec<String> = keys.into_iter().filter(|key| !metrics.contains(key)).collect();
        let is_shown =
            |metric: &String| !self.shows_decisions || ![RUNTIME, NETWORK_TIME].contains(&metric.as_str());
        let metrics: Vec<String> = metrics.into_iter().filter(is_shown).collect();
        let parts = if self.shows_decisions { 0..decisions::TITLES.len() } else { 0..0 };
        let mut lines: Vec<Line<'_>> = Vec::new();
        for (number, group) in group_by(&results.rows, &keys).into_iter().enumerate() {
            // All metrics of a group use the same random stream, so that equal values have equal intervals.
            let estimate = |values: &[f64]| Estimate::of(values, self.spread, number as u64);
            let of_metrics = metrics.iter().map(|metric| estimate(&values(&group.rows, metric)));
            let of_part = |part: usize| group.rows.iter().filter_map(move |row| decisions::times(row)[part]);
            let of_decisions = parts.clone().map(|part| estimate(&of_part(part).collect::<Vec<_>>()));
            let estimates = of_metrics.chain(of_decisions).collect();
            lines.push(Line { group, estimates });
        }
        let notes = lacking(&results.rows, &metrics);
        let titles = parts.map(|part| decisions::TITLES[part].to_owned());
        let columns: Vec<String> = metrics.into_iter().chain(titles).collect();
        self.sort(name, &mut lines, &keys, &columns)?;
        let table = self.table(&lines, &keys, &columns);
        Ok(Shown { tables: vec![table], notes, ..Shown::default() })
    }

    fn table(&self, lines: &[Line<'_>], keys: &[String], metrics: &[String]) -> Table {
        let row = |line: &Line<'_>| {
            let texts = keys.iter().zip(&line.group.keys);
            let texts = texts.map(|(column, value)| Cell::Text(self.common.shown(column, value)));
            texts.chain(line.estimates.iter().map(|estimate| Cell::Mean(*estimate))).collect()
        };
        Table {
            head: keys.iter().chain(metrics).map(|column| self.common.title(column)).collect(),
            rows: lines.iter().map(row).collect(),
            digits: self.common.digits,
            skips_zero: self.skips_zero,
            remark: self.remark(lines),
        }
    }

    fn remark(&self, lines: &[Line<'_>]) -> Option<String> {
        let mut estimates = lines.iter().flat_map(|line| &line.estimates).flatten();
        estimates.find(|estimate| estimate.interval.is_some())?;
        match self.spread {
            Spread::Bootstrap { level } => Some(format!(
                "mean ± half the width of its {level} % bootstrap interval ({RESAMPLES} resamples)"
            )),
            Spread::Deviation { factor } => Some(format!("mean ± {factor} times the standard deviation")),
            Spread::None => None,
        }
    }

    /// Sorts by the columns of `sort_by`; the first of them has precedence.
    fn sort(
        &self,
        name: &str,
        lines: &mut [Line<'_>],
        keys: &[String],
        metrics: &[String],
    ) -> Result<(), Error> {
        for column in self.common.sort_by.iter().rev() {
            let place = |columns: &[String]| columns.iter().position(|known| known == column);
            match (place(keys), place(metrics)) {
                (Some(at), _) => {
                    lines.sort_by(|one, other| compare(&one.group.keys[at], &other.group.keys[at]));
                }
                (_, Some(at)) => {
                    let mean = |line: &Line<'_>| line.estimates[at].map_or(f64::INFINITY, |found| found.mean);
                    lines.sort_by(|one, other| mean(one).total_cmp(&mean(other)));
                }
                _ => {
                    let known = keys.iter().chain(metrics).map(String::as_str);
                    return Err(unknown_name(name, "sort_by", column, "a column of the table", known));
                }
            }
        }
        Ok(())
    }
}

/// A row of the table before it is formatted.
struct Line<'a> {
    group: Group<'a>,
    estimates: Vec<Option<Estimate>>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::views::View;

    const ROWS: &str = r#"[
        {"metrics": {"CSR": 1.0, "steps": [1]}, "env_grid_search": {"num_agents": 16, "seed": 0}, "algorithm": "B"},
        {"metrics": {"CSR": 0.0, "SoC": 9}, "env_grid_search": {"num_agents": 16, "seed": 1}, "algorithm": "B"},
        {"metrics": {"CSR": 1.0, "SoC": 7}, "env_grid_search": {"num_agents": 8, "seed": 0}, "algorithm": "A"}
    ]"#;

    fn shown(fields: &str) -> Result<Shown, String> {
        let results = Results { rows: serde_json::from_str(ROWS).unwrap(), notes: Vec::new() };
        let view = View::read("Table1", &Node::parse(fields).unwrap());
        view.and_then(|view| view.show("Table1", &results, None)).map_err(|error| error.to_string())
    }

    #[test]
    fn each_group_has_a_row_and_each_metric_a_column() {
        let shown = shown("{type: tabular, show_std: False, sort_by: algorithm}").unwrap();
        assert_eq!(
            shown.tables[0].text(Format::Csv).lines().collect::<Vec<_>>(),
            [
                "Number of Agents,Algorithm,CSR,CSR low,CSR high,CSR n,SoC,SoC low,SoC high,SoC n",
                "8,A,1,,,1,7,,,1",
                "16,B,0.5,,,2,9,,,1",
            ]
        );
        assert_eq!(shown.notes, ["`B` has no `SoC` in 1 of 2 rows; these rows are left out"]);
    }

    #[test]
    fn intervals_are_shown_and_explained() {
        let fields = "{type: tabular, drop_keys: [seed, SoC], rename_algorithms: {B: Best}, round_digits: 1}";
        let text = shown(fields).unwrap().tables[0].text(Format::Markdown);
        assert!(text.contains("| 16               | Best      | 0.5 ± 0.5 |"), "{text}");
        assert!(text.ends_with("its 95 % bootstrap interval (1000 resamples)"), "{text}");
    }

    #[test]
    fn decision_times_replace_run_times() {
        let rows = r#"[
            {"metrics": {"SoC": 9, "ep_length": 5, "runtime": 4e-4, "network_time": 1e-4},
             "env_grid_search": {"num_agents": 2}, "algorithm": "A"},
            {"metrics": {"avg_throughput": 1, "ep_length": 7, "runtime": 8e-4},
             "env_grid_search": {"num_agents": 2, "max_episode_steps": 8}, "algorithm": "B"},
            {"metrics": {"ISR": 1, "ep_length": 7, "runtime": 8e-4},
             "env_grid_search": {"num_agents": 2, "max_episode_steps": 9}, "algorithm": "C"}
        ]"#;
        let results = Results { rows: serde_json::from_str(rows).unwrap(), notes: Vec::new() };
        let fields = "{type: tabular, show_std: False, decision_times: True, drop_keys: [num_agents, max_episode_steps]}";
        let view = View::read("Table1", &Node::parse(fields).unwrap()).unwrap();
        let text = view.show("Table1", &results, None).unwrap().tables[0].text(Format::Markdown);
        let lines: Vec<Vec<&str>> = text
            .lines()
            .map(|line| line.split('|').map(str::trim).filter(|cell| !cell.is_empty()).collect())
            .collect();
        assert_eq!(
            lines[0],
            ["Algorithm", "SoC", "ep_length", "Average Throughput", "ISR", "planner µs", "network µs"]
        );
        let times: Vec<&[&str]> = lines[2..5].iter().map(|line| &line[line.len() - 2..]).collect();
        assert_eq!(times, [["30.00", "10.00"], ["50.00", "-"], ["-", "-"]]);
    }

    #[test]
    fn wrong_options_are_reported_with_line_numbers() {
        let error_of = |fields: &str| shown(&format!("type: tabular\n{fields}")).unwrap_err();
        let unknown = "config: line 2: unknown key `round_digit` in view `Table1`";
        assert!(error_of("round_digit: 3").starts_with(unknown), "{}", error_of("round_digit: 3"));
        assert!(
            error_of("round_digits: x")
                .contains("line 2: `Table1.round_digits` is `x`, expected a whole number")
        );
        assert!(error_of("table_format: latx").contains("did you mean `latex`?"));
        assert!(error_of("show_std: 3").contains("`Table1.show_std` is `3`, expected True or False"));
        assert!(error_of("sort_by: SOC").contains("did you mean `SoC`?"));
        assert!(shown("type: tablar").unwrap_err().contains("did you mean `tabular`?"));
    }
}
