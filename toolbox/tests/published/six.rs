//! The six metrics, as published and as defined in the paper's text.

use pogema_core::Words;
use pogema_toolbox::six::{Definition, Metric, six};

use crate::archive::published;

const SETS: [&str; 6] =
    ["01-random", "02-mazes", "03-warehouse", "04-movingai", "05-puzzles", "06-pathfinding"];

#[test]
fn all_published_metrics_are_reproduced() {
    let Some(published) = published("the six metrics against the published ones") else { return };
    let (all, notes) = six(&published.read(&SETS), Definition::Published);
    assert_eq!(notes, Vec::<String>::new());
    let rows = published.csv("meta_metrics_mapf.csv");
    assert_eq!((rows.len(), all.len()), (9, 8));
    let mut cells = 0;
    for row in &rows[1..] {
        let six = all.iter().find(|six| six.algorithm == row[1]).unwrap();
        let named = Metric::all().map(Words::word).zip(six.values);
        for (name, value) in named.chain([("Scalability_unclipped", six.unbounded_scalability)]) {
            let column = rows[0].iter().position(|title| title == name).unwrap();
            let expected: f64 = row[column].parse().unwrap();
            let value = value.unwrap();
            assert!((value - expected).abs() < 1e-5, "{} {name}: {value}, expected {expected}", &row[1]);
            cells += 1;
        }
    }
    assert_eq!(cells, 56);
}

#[test]
fn the_definition_in_the_paper_gives_the_values_of_another_program() {
    let Some(published) = published("the six metrics as defined in the paper") else { return };
    let (all, _) = six(&published.read(&SETS), Definition::Paper);
    // Computed by another program from the same files.
    let expected = [
        ("LaCAM", [0.992_133, 0.992_188, 0.962_419, 2.364_417, 1.0, 1.0]),
        ("SCRIMP", [0.606_994, 0.703_500, 0.633_325, 0.445_541, 1.0, 0.630_427]),
        ("DCC", [0.424_317, 0.585_493, 0.504_291, 0.440_900, 0.982_137, 0.979_869]),
        ("MAMBA", [0.076_699, 0.0, 0.265_861, 2.023_707, 0.752_968, 0.814_723]),
    ];
    for (algorithm, values) in expected {
        let six = all.iter().find(|six| six.algorithm == algorithm).unwrap();
        for ((metric, value), expected) in Metric::all().zip(six.values).zip(values) {
            assert!(
                (value.unwrap() - expected).abs() < 1e-6,
                "{algorithm} {metric:?}: {value:?}, expected {expected}"
            );
        }
    }
}
