//! Tables and their text formats.

use comfy_table::{CellAlignment, Table as Drawn, presets};
use pogema_core::words;

use crate::bootstrap::Estimate;
use crate::fit::fitted;

words! {
    /// The text format of a table.
    pub enum Format {
        /// Cells with borders, for a terminal.
        Terminal = "terminal",
        /// GitHub's Markdown.
        Markdown = "markdown",
        /// LaTeX with the rules of the package booktabs.
        Latex = "latex",
        /// Comma-separated values; separate columns for a mean, the ends of its interval and the number of values.
        Csv = "csv",
        /// The same columns, separated by tabs.
        Tsv = "tsv",
    }
}

/// The content of a cell.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// A text, aligned left.
    Text(String),
    /// A whole number, aligned right.
    Count(usize),
    /// A number without an interval, aligned right; `None` if missing.
    Number(Option<f64>),
    /// A share or ratio, with at least four decimals, aligned right; `None` if missing.
    Ratio(Option<f64>),
    /// A mean and its interval; `None` if no row has a number.
    Mean(Option<Estimate>),
}

/// A table, independent of its format.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// The titles of its columns.
    pub head: Vec<String>,
    /// Its cells; each row has one per column.
    pub rows: Vec<Vec<Cell>>,
    /// Number of decimals.
    pub digits: usize,
    /// Whether an interval of length zero is left out.
    pub skips_zero: bool,
    /// An explanation of the table, in one line.
    pub remark: Option<String>,
}

impl Table {
    /// Returns the text of the table, without a line break at its end.
    pub fn text(&self, format: Format) -> String {
        match format {
            Format::Terminal => self.drawn(presets::UTF8_FULL_CONDENSED, str::to_owned),
            Format::Markdown => {
                self.drawn(presets::ASCII_MARKDOWN, |text| text.replace('|', "\\|").replace('\n', "<br>"))
            }
            Format::Latex => self.latex(),
            Format::Csv => self.separated(b','),
            Format::Tsv => self.separated(b'\t'),
        }
    }

    fn drawn(&self, style: comfy_table::TableStyle, escape: impl Fn(&str) -> String) -> String {
        let mut table = Drawn::new();
        table.load_style(style).set_header(self.head.iter().map(|title| escape(title)));
        for row in &self.rows {
            table.add_row(row.iter().map(|cell| escape(&self.shown(cell))));
        }
        for (index, column) in table.column_iter_mut().enumerate() {
            if self.is_numeric(index) {
                column.set_cell_alignment(CellAlignment::Right);
            }
        }
        let is_markdown = style == presets::ASCII_MARKDOWN;
        let (table, gap) = if is_markdown { (table.to_string(), "\n\n") } else { (fitted(table), "\n") };
        format!("{table}{}", self.remark.as_ref().map(|remark| format!("{gap}{remark}")).unwrap_or_default())
    }

    /// Returns the texts of all cells.
    pub fn texts(&self) -> Vec<Vec<String>> {
        self.rows.iter().map(|row| row.iter().map(|cell| self.shown(cell)).collect()).collect()
    }

    /// Returns whether a column holds numbers.
    pub fn is_numeric(&self, column: usize) -> bool {
        self.rows.iter().any(|row| !matches!(row.get(column), Some(Cell::Text(_)) | None))
    }

    fn shown(&self, cell: &Cell) -> String {
        match cell {
            Cell::Text(text) => text.clone(),
            Cell::Count(count) => count.to_string(),
            Cell::Number(None) | Cell::Ratio(None) | Cell::Mean(None) => "-".to_owned(),
            Cell::Number(Some(number)) => format!("{number:.*}", self.digits),
            Cell::Ratio(Some(ratio)) => format!("{ratio:.*}", self.digits.max(4)),
            Cell::Mean(Some(estimate)) => self.parts(estimate).join(" ± "),
        }
    }

    /// Returns the text of the mean, and that of half its interval if it is shown.
    fn parts(&self, estimate: &Estimate) -> Vec<String> {
        let half = estimate.half().filter(|&half| !(self.skips_zero && half == 0.0));
        let numbers = [Some(estimate.mean), half];
        numbers.into_iter().flatten().map(|number| format!("{number:.*}", self.digits)).collect()
    }

    fn latex(&self) -> String {
        let columns: String =
            (0..self.head.len()).map(|at| if self.is_numeric(at) { 'r' } else { 'l' }).collect();
        let line = |cells: Vec<String>| format!("{} \\\\\n", cells.join(" & "));
        let cell = |cell: &Cell| match cell {
            Cell::Mean(Some(estimate)) => format!("${}$", self.parts(estimate).join(" \\pm ")),
            // Outside of math mode, a minus sign is a hyphen.
            other => match self.shown(other) {
                text if matches!(other, Cell::Number(Some(_)) | Cell::Ratio(Some(_)))
                    && text.starts_with('-') =>
                {
                    format!("${text}$")
                }
                text => latex_text(&text),
            },
        };
        let remark = self.remark.as_ref().map(|remark| format!("% {remark}\n")).unwrap_or_default();
        let head = line(self.head.iter().map(|title| latex_text(title)).collect());
        let body: String = self.rows.iter().map(|row| line(row.iter().map(cell).collect())).collect();
        format!(
            "{remark}\\begin{{tabular}}{{{columns}}}\n\\toprule\n{head}\\midrule\n{body}\\bottomrule\n\\end{{tabular}}"
        )
    }

    fn separated(&self, delimiter: u8) -> String {
        let is_mean =
            |column: usize| self.rows.iter().any(|row| matches!(row.get(column), Some(Cell::Mean(_))));
        let head = self.head.iter().enumerate().flat_map(|(column, title)| {
            let more = ["low", "high", "n"].map(|part| format!("{title} {part}"));
            std::iter::once(title.clone()).chain(more.into_iter().take(if is_mean(column) { 3 } else { 0 }))
        });
        let rows = self.rows.iter().map(|row| row.iter().flat_map(separate_cells).collect::<Vec<_>>());
        let mut writer = csv::WriterBuilder::new().delimiter(delimiter).from_writer(Vec::new());
        for record in std::iter::once(head.collect()).chain(rows) {
            // Writing to a vector cannot fail, and all rows have the same length.
            let _ = writer.write_record(&record);
        }
        let text = String::from_utf8(writer.into_inner().unwrap_or_default()).unwrap_or_default();
        text.trim_end_matches('\n').to_owned()
    }
}

fn separate_cells(cell: &Cell) -> Vec<String> {
    match cell {
        Cell::Text(text) => vec![text.clone()],
        Cell::Count(count) => vec![count.to_string()],
        Cell::Number(number) | Cell::Ratio(number) => {
            vec![number.map(|number| number.to_string()).unwrap_or_default()]
        }
        Cell::Mean(None) => vec![String::new(), String::new(), String::new(), "0".to_owned()],
        Cell::Mean(Some(Estimate { mean, interval, count })) => {
            let end = |end: Option<f64>| end.map(|end| end.to_string()).unwrap_or_default();
            let (low, high) = interval.unzip();
            vec![mean.to_string(), end(low), end(high), count.to_string()]
        }
    }
}

/// Escapes the special characters of LaTeX in a text.
fn latex_text(text: &str) -> String {
    let mut escaped = String::new();
    for letter in text.chars() {
        match letter {
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => escaped.extend(['\\', letter]),
            '~' => escaped.push_str("\\textasciitilde{}"),
            '^' => escaped.push_str("\\textasciicircum{}"),
            '\\' => escaped.push_str("\\textbackslash{}"),
            // The default font encoding has other characters at these positions.
            '<' => escaped.push_str("\\textless{}"),
            '>' => escaped.push_str("\\textgreater{}"),
            '|' => escaped.push_str("\\textbar{}"),
            '±' => escaped.push_str("$\\pm$"),
            '\n' => escaped.push(' '),
            letter => escaped.push(letter),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let mean = |mean, interval| Cell::Mean(Some(Estimate { mean, interval, count: 8 }));
        Table {
            head: vec!["map_name".into(), "SoC".into()],
            rows: vec![
                vec![Cell::Text("a|b".into()), mean(2.125, Some((1.0, 2.0)))],
                vec![Cell::Text("c".into()), mean(7.0, Some((7.0, 7.0)))],
                vec![Cell::Text("d".into()), Cell::Mean(None)],
            ],
            digits: 2,
            skips_zero: true,
            remark: None,
        }
    }

    #[test]
    fn negative_numbers_have_a_minus_sign_in_latex() {
        let cells = vec![Cell::Number(Some(-1.5)), Cell::Ratio(Some(-0.25)), Cell::Number(Some(2.0))];
        let head = ["a", "b", "c"].map(str::to_owned).to_vec();
        let table = Table { head, rows: vec![cells], digits: 2, ..Table::default() };
        assert!(table.text(Format::Latex).contains("$-1.50$ & $-0.2500$ & 2.00 \\\\"));
    }

    #[test]
    fn every_format_has_the_same_content() {
        let lines = |format| table().text(format).lines().map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(lines(Format::Markdown)[2], "| a\\|b     | 2.12 ± 0.50 |");
        assert_eq!(lines(Format::Terminal)[4], "│ c        ┆        7.00 │");
        let expected = ["a\\textbar{}b & $2.12 \\pm 0.50$ \\\\", "c & $7.00$ \\\\", "d & - \\\\"];
        assert_eq!(lines(Format::Latex)[2..7][0], "map\\_name & SoC \\\\");
        assert_eq!(lines(Format::Latex)[4..7], expected);
        let expected = ["map_name,SoC,SoC low,SoC high,SoC n", "a|b,2.125,1,2,8", "c,7,7,7,8", "d,,,,0"];
        assert_eq!(lines(Format::Csv), expected);
        assert_eq!(lines(Format::Tsv), expected.map(|line| line.replace(',', "\t")));
        let cells = vec![Cell::Text(".#\n..".into())];
        let two_lines = Table { head: vec!["map".into()], rows: vec![cells], ..Table::default() };
        assert_eq!(two_lines.text(Format::Markdown).lines().last(), Some("| .#<br>.. |"));
        assert!(two_lines.text(Format::Latex).contains("\n.\\# .. \\\\\n"));
    }

    #[test]
    fn numbers_are_rounded_as_in_python() {
        // f"{179.825:.2f}" and f"{755.975:.2f}": the nearest double is below the first number and above the second.
        let shown = |mean| table().shown(&Cell::Mean(Some(Estimate { mean, interval: None, count: 1 })));
        assert_eq!([shown(179.825), shown(755.975), shown(0.125)], ["179.82", "755.98", "0.12"]);
    }
}
