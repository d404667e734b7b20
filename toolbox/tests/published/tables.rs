//! Tables of the paper, reproduced by views of the published results.

use pogema_toolbox::Results;
use pogema_toolbox::views::{Cell, Shown, View};
use pogema_toolbox::{Node, Row};

use crate::archive::{Published, published};

fn table(results: &Results, drop_keys: &str) -> Shown {
    let fields = format!("{{type: tabular, drop_keys: [{drop_keys}]}}");
    View::read("Table", &Node::parse(&fields).unwrap()).unwrap().show("Table", results, None).unwrap()
}

/// Returns the mean of a column for an algorithm, without its interval.
fn printed(shown: &Shown, algorithm: &str, column: &str) -> String {
    let table = &shown.tables[0];
    let at = table.head.iter().position(|title| title == column).unwrap();
    let row = table.rows.iter().find(|row| row[0] == Cell::Text(algorithm.to_owned())).unwrap();
    match &row[at] {
        Cell::Mean(Some(estimate)) => format!("{:.2}", estimate.mean),
        other => format!("{other:?}"),
    }
}

/// Returns the mean of a column over all numbers of agents, from the published means of each number.
fn published_mean(published: &Published, set: &str, algorithm: &str, column: &str) -> f64 {
    let rows = published.csv("published.csv");
    let at = |title: &str| rows[0].iter().position(|found| found == title).unwrap();
    let own = rows
        .iter()
        .filter(|row| row[0] == *"MAPF" && row[at("dataset")] == *set && row[at("algorithm")] == *algorithm);
    let number = |text: &str| text.parse::<f64>().unwrap();
    let (sum, count) = own.fold((0.0, 0.0), |(sum, count), row| {
        let n = number(&row[at("n")]);
        (sum + n * number(&row[at(column)]), count + n)
    });
    sum / count
}

#[test]
fn table_5_is_reproduced_to_the_printed_digit() {
    let Some(published) = published("the paper's table 5") else { return };
    let results = published.read(&["06-pathfinding"]);
    let shown = table(&results, "seed, map_name, num_agents");
    assert_eq!(printed(&shown, "LaCAM", "makespan"), "179.82");
    for algorithm in results.algorithms() {
        let expected = published_mean(published, "06-pathfinding", &algorithm, "makespan");
        let found: f64 = printed(&shown, &algorithm, "makespan").parse().unwrap();
        assert!((found - expected).abs() < 0.0051, "{algorithm}: {found} {expected}");
    }
    // The exact value is 755.975.
    let all = results.algorithms();
    assert!(all.iter().any(|algorithm| printed(&shown, algorithm, "makespan") == "755.98"));
}

#[test]
fn table_4_is_reproduced_without_puzzle_06() {
    let Some(published) = published("the paper's table 4") else { return };
    let results = published.read(&["05-puzzles"]);
    let drop = "seed, map_name, ISR, ep_length, runtime, avg_agents_density, makespan, num_agents, a_collisions, o_collisions";
    let whole = table(&results, drop);
    assert_eq!(printed(&whole, "LaCAM", "SoC"), "36.29");
    assert_eq!(printed(&whole, "LaCAM", "CSR"), "0.96");
    let is_in = |row: &&Row| row.settings.get("map_name").unwrap() != "puzzle-06";
    let rows: Vec<Row> = results.rows.iter().filter(is_in).cloned().collect();
    assert_eq!(rows.len(), 8 * 450);
    let without = table(&Results { rows, notes: Vec::new() }, drop);
    assert_eq!(without.tables[0].head, ["Algorithm", "CSR", "SoC"]);
    assert_eq!(printed(&without, "LaCAM", "CSR"), "1.00");
    // The means printed in the paper.
    let expected = [
        ("DCC", "0.74", "93.50"),
        ("IQL", "0.47", "250.03"),
        ("LaCAM", "1.00", "20.84"),
        ("MAMBA", "0.40", "173.60"),
        ("QMIX", "0.35", "253.28"),
        ("QPLEX", "0.51", "234.79"),
        ("SCRIMP", "0.85", "77.86"),
        ("VDN", "0.45", "242.42"),
    ];
    for (algorithm, csr, soc) in expected {
        let found = ["CSR", "SoC"].map(|column| printed(&without, algorithm, column));
        assert_eq!(found, [csr, soc], "{algorithm}");
    }
}
