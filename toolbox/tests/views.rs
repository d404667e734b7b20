//! Views of small artificial results: box plots, cactus plots, comparisons, checks of seeds and the six metrics.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pogema_toolbox::six::Definition;
use pogema_toolbox::views::{Format, ImageFormat, Shown, View};
use pogema_toolbox::{Node, Results, Row};

/// Returns a row of an algorithm and a seed. Its runtime in seconds is half its cost; without a cost, it is unsolved.
fn row(set: &str, algorithm: &str, seed: u64, cost: Option<u64>) -> Row {
    let (csr, soc) = (u8::from(cost.is_some()), cost.unwrap_or(999));
    let text = format!(
        r#"{{"metrics": {{"CSR": {csr}, "SoC": {soc}, "makespan": {soc}, "runtime": {}}},
            "env_grid_search": {{"num_agents": {}, "seed": {seed}}}, "algorithm": "{algorithm}"}}"#,
        soc as f64 / 2.0,
        2 + 2 * (seed % 2),
    );
    Row { set: set.to_owned(), ..serde_json::from_str(&text).unwrap() }
}

fn results() -> Results {
    let costs = [(Some(4), Some(4)), (Some(5), Some(9)), (Some(7), None), (None, Some(8)), (None, None)];
    let sets = ["01-random", "02-mazes", "03-warehouse", "04-movingai", "05-puzzles", "06-pathfinding"];
    let rows = sets.iter().flat_map(|set| {
        costs.iter().zip(0..).flat_map(move |((one, other), seed)| {
            [row(set, "One", seed, *one), row(set, "Other", seed, *other)]
        })
    });
    Results { rows: rows.collect(), notes: Vec::new() }
}

fn show_of(results: &Results, fields: &str) -> Result<Shown, String> {
    let view = View::read("View1", &Node::parse(fields).unwrap());
    view.and_then(|view| view.show("View1", results, None)).map_err(|error| error.to_string())
}

fn show(fields: &str) -> Result<Shown, String> {
    show_of(&results(), fields)
}

fn svg(shown: &Shown) -> String {
    String::from_utf8(shown.pictures[0].bytes(ImageFormat::Svg).unwrap()).unwrap()
}

fn csv(shown: &Shown) -> Vec<String> {
    shown.tables[0].text(Format::Csv).lines().map(str::to_owned).collect()
}

#[test]
fn a_comparison_counts_each_instance_once() {
    let shown = show("{type: compare}").unwrap();
    assert_eq!(
        csv(&shown),
        [
            "One and Other: SoC,Instances",
            "One is better,6",
            "both are equal,6",
            "Other is better,0",
            "only One solved it,6",
            "only Other solved it,6",
            "neither solved it,6",
        ]
    );
    assert!(svg(&shown).contains(">SoC, One<"));
    let shown = show("{type: compare, y: CSR, first: Other, second: One}").unwrap();
    // This comparison includes unsolved instances, so the table has no separate rows for them.
    assert_eq!(csv(&shown)[1..], ["Other is better,6", "both are equal,18", "One is better,6"]);
    let error = show("{type: compare, first: One, second: Oter}").unwrap_err();
    assert!(error.ends_with("expected an algorithm of the results; did you mean `Other`?"), "{error}");
    let error = show("{type: compare, first: One, second: One}").unwrap_err();
    assert!(error.ends_with("`first` and `second` are both `One`, expected two algorithms"), "{error}");
    assert!(show("{type: compare, first: One}").unwrap_err().contains("each one of One, Other"));
}

#[test]
fn an_instance_without_a_value_is_noted_once() {
    let mut broken = results();
    broken.rows[0].metrics.retain(|name, _| name != "SoC");
    broken.rows[1].metrics.retain(|name, _| name != "SoC");
    let notes = show_of(&broken, "{type: compare}").unwrap().notes;
    assert_eq!(
        notes.last().unwrap(),
        "view `View1`: 1 instance left out, because a row or its value is missing"
    );
}

#[test]
fn equal_numbers_share_a_box() {
    let mut results = results();
    for (number, row) in results.rows.iter_mut().enumerate() {
        let width = if number % 2 == 0 { serde_json::json!(1) } else { serde_json::json!(1.0) };
        row.settings.insert("width".into(), width);
    }
    let text = svg(&show_of(&results, "{type: box, x: width, y: SoC}").unwrap());
    assert_eq!(text.matches(">1<").count() + text.matches(">1.0<").count(), 1, "{text}");
}

/// Checks that the line and the panel of a number include the rows of both spellings of that number.
#[test]
fn equal_numbers_share_a_line_and_a_panel() {
    // The plotting library assigns numbers to clip paths across all plots of a process.
    let drawn = |results: &Results, view: &str| {
        let text = svg(&show_of(results, view).unwrap());
        let parts = text
            .split("kuva-clip-")
            .map(|part| part.trim_start_matches(|digit: char| digit.is_ascii_digit()));
        parts.collect::<String>()
    };
    let mut mixed = results();
    for (number, row) in mixed.rows.iter_mut().enumerate() {
        let width = if number % 2 == 0 { serde_json::json!(1) } else { serde_json::json!(1.0) };
        row.settings.insert("width".into(), width);
    }
    let mut equal = results();
    for row in &mut equal.rows {
        row.settings.insert("width".into(), serde_json::json!(1));
    }
    for view in [
        "{type: plot, x: num_agents, y: SoC, by: width}",
        "{type: multi-plot, x: num_agents, y: SoC, over: width}",
    ] {
        assert_eq!(drawn(&mixed, view), drawn(&equal, view), "{view}");
    }
}

#[test]
fn sort_by_a_dropped_column_is_rejected() {
    let error = show("{type: tabular, drop_keys: [seed], sort_by: seed}").unwrap_err();
    assert!(error.contains("`sort_by` is `seed`, expected a column of the table"), "{error}");
}

#[test]
fn missing_and_duplicated_results_are_shown() {
    let shown = show("{type: seeds}").unwrap();
    assert_eq!(shown.notes, ["view `View1`: every algorithm has each instance once, 30 in all"]);
    let mut broken = results();
    broken.rows.remove(0);
    let double = broken.rows[2].clone();
    broken.rows.push(double);
    let shown = show_of(&broken, "{type: seeds}").unwrap();
    assert_eq!(
        csv(&shown),
        ["Folder,Number of Agents,seed,One,Other", "01-random,2,0,missing,ok", "01-random,4,1,ok,x2",]
    );
    assert!(
        shown.tables[0].text(Format::Markdown).ends_with("2 results of 30 instances missing or duplicated")
    );
}

#[test]
fn box_and_cactus_plots_are_drawn_from_available_rows() {
    let text = svg(&show("{type: box, y: SoC}").unwrap());
    assert!(text.contains(">One<") && text.contains(">SoC<"), "{text}");
    let text = svg(&show("{type: cactus}").unwrap());
    assert!(text.contains(">Solved Instances<") && text.contains(">Runtime (seconds)<"), "{text}");
    let mut timeless = results();
    timeless.rows.retain_mut(|row| row.algorithm != "One" || row.metrics.shift_remove("runtime").is_some());
    let notes = show_of(&timeless, "{type: cactus}").unwrap().notes;
    assert!(notes.iter().any(|note| note == "`One` has no solved row with `runtime`"), "{notes:?}");
    assert!(show("{type: cactus, x: run_time}").unwrap_err().contains("did you mean `runtime`?"));
    let none = results().rows.into_iter().filter(|row| row.metric("CSR") == Some(0.0)).collect();
    let none = Results { rows: none, notes: Vec::new() };
    assert!(show_of(&none, "{type: cactus}").unwrap_err().contains("no solved row has"));
}

#[test]
fn six_metrics_are_shown_as_table_and_radar_plot() {
    let shown = show("{type: radar, round_digits: 4}").unwrap();
    let rows = csv(&shown);
    assert!(
        rows[0].starts_with("Algorithm,Performance,Out-of-Distribution,Cooperation,Scalability"),
        "{rows:?}"
    );
    // Of the four instances with a solution, One solved three at the best cost.
    assert!(rows[1].starts_with("One,0.75,0.75,0.75,"), "{rows:?}");
    assert!(svg(&shown).contains(">Cooperation<"));
    let view = View::read("View1", &Node::parse("{type: radar}").unwrap()).unwrap();
    let paper = view.show("View1", &results(), Some(Definition::Paper)).unwrap();
    assert!(csv(&paper)[1].starts_with("One,0.6,0.6,0.6,"), "{:?}", csv(&paper));
    let other = Results { rows: vec![row("elsewhere", "One", 0, None)], notes: Vec::new() };
    let error = show_of(&other, "{type: radar}").unwrap_err();
    assert!(error.contains("no folder with `random` in its name"), "{error}");
}

#[test]
fn a_logarithmic_axis_drawn_as_linear_is_noted() {
    let (positive, mut with_zero) = (results(), results());
    for row in &mut with_zero.rows {
        row.metrics.insert("runtime".into(), 0.into());
    }
    let note = "view `View1`: an axis with values of 0 or less is linear, not logarithmic";
    for fields in [
        "{type: box, x: num_agents, y: runtime, use_log_scale_y: True}",
        "{type: cactus}",
        "{type: compare, y: runtime, use_log_scale_x: True}",
        "{type: plot, x: num_agents, y: runtime, use_log_scale_y: True}",
    ] {
        let is_noted = |results| show_of(results, fields).unwrap().notes.iter().any(|found| found == note);
        assert_eq!([is_noted(&positive), is_noted(&with_zero)], [false, true], "{fields}");
    }
}
