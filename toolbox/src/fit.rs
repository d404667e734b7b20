//! Fits tables to the width of the terminal.

use comfy_table::{Cell, ContentArrangement, Row, Table, presets};

/// The least width per column at which wrapped cells can be read. Units: characters.
const READABLE: usize = 12;

/// Returns the text of a table. No line is wider than the table's set width, or than the terminal that the text is
/// printed to. Output to files and pipes is not changed.
///
/// Wide cells are wrapped. If the columns would be too narrow for that, each row is a list of titles and cells.
pub fn fitted(mut table: Table) -> String {
    // Each column has a gap on both sides and a line after it; one more line is at the left edge.
    let columns = table.column_max_content_widths();
    let natural = columns.iter().map(|&width| usize::from(width) + 3).sum::<usize>() + 1;
    match table.width() {
        Some(width) if natural > usize::from(width) && usize::from(width) >= READABLE * columns.len() => {
            table.set_content_arrangement(ContentArrangement::Dynamic);
            table.to_string()
        }
        Some(width) if natural > usize::from(width) => lists(&table, width),
        _ => table.to_string(),
    }
}

/// Returns each row as a list of titles and cells, with a blank line between rows.
fn lists(table: &Table, width: u16) -> String {
    let titles: Vec<String> =
        table.header().into_iter().flat_map(|row| row.cell_iter().map(Cell::content)).collect();
    let list = |row: &Row| {
        let mut list = Table::new();
        list.load_style(presets::NOTHING).set_width(width);
        list.set_content_arrangement(ContentArrangement::Dynamic);
        for (title, cell) in titles.iter().zip(row.cell_iter()) {
            list.add_row([title.clone(), cell.content()]);
        }
        list.trim_fmt()
    };
    table.row_iter().map(list).collect::<Vec<_>>().join("\n\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(num_columns: usize, width: Option<u16>) -> String {
        let mut table = Table::new();
        table.load_style(presets::ASCII_MARKDOWN);
        table.set_header((0..num_columns).map(|at| format!("title of column {at}")));
        for row in 0..2 {
            table.add_row((0..num_columns).map(|at| format!("cell {at} of row {row}, which is rather long")));
        }
        if let Some(width) = width {
            table.set_width(width);
        }
        fitted(table)
    }

    fn widest(text: &str) -> usize {
        text.lines().map(|line| line.chars().count()).max().unwrap()
    }

    #[test]
    fn no_line_is_wider_than_the_terminal() {
        for num_columns in [1, 2, 3, 6, 13] {
            for width in [20, 40, 80, 157] {
                let text = table(num_columns, Some(width));
                assert!(widest(&text) <= usize::from(width), "{num_columns} columns in {width}:\n{text}");
                for at in 0..num_columns {
                    assert!(text.contains(&at.to_string()), "{text}");
                }
            }
        }
        assert!(widest(&table(13, None)) > 400);
        assert_eq!(table(2, Some(200)), table(2, None));
    }
}
