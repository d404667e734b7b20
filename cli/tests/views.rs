//! Tests of `pogema views`: tables, plots, and invalid results or views.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod program;

use std::fs;

use program::pogema as run;

const SUITE: &str = "
results_views:
  Table1:
    type: tabular
    drop_keys: [seed]
  Costs / all:
    type: plot
    x: num_agents
    y: SoC
    extension: svg
";

fn row(algorithm: &str, num_agents: u64, seed: u64, cost: &str) -> String {
    format!(
        r#"{{"metrics": {{"CSR": 1.0, "SoC": {cost}}},
            "env_grid_search": {{"num_agents": {num_agents}, "seed": {seed}}}, "algorithm": "{algorithm}"}}"#
    )
}

/// Returns a folder whose subfolder `out` holds the results of two algorithms, and of a third that is not finished.
fn results() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    fs::create_dir(&out).unwrap();
    for (algorithm, costs) in [("One", ["4", "8", "9", "10"]), ("Other", ["5", "7", "NaN", "12"])] {
        let rows: Vec<String> = costs
            .iter()
            .zip(0..)
            .map(|(cost, number)| row(algorithm, if number < 2 { 16 } else { 8 }, number % 2, cost))
            .collect();
        fs::write(out.join(format!("{algorithm}.json")), format!("[{}]", rows.join(","))).unwrap();
    }
    fs::write(out.join("Third.jsonl"), "{").unwrap();
    fs::write(out.join("suite.yaml"), SUITE).unwrap();
    folder
}

#[test]
fn tables_are_printed_and_plots_are_written() {
    let folder = results();
    let (text, notes, status) = run(folder.path(), &["views", "out", "--format", "csv"]);
    assert_eq!(status, 0, "{notes}");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "Number of Agents,Algorithm,CSR,CSR low,CSR high,CSR n,SoC,SoC low,SoC high,SoC n");
    assert_eq!(lines.len(), 5);
    assert!(lines[1].starts_with("8,One,1,1,1,2,9.5,9,10,2"), "{text}");
    assert!(lines[2].starts_with("8,Other,1,1,1,2,12,,,1"), "{text}");
    assert!(notes.contains("note: out: `Third` is not finished, so it is left out"), "{notes}");
    assert!(notes.contains("note: `Other` has no `SoC` in 1 of 4 rows; these rows are left out"), "{notes}");
    let path = folder.path().join("out/views/Costs _ all.svg");
    assert!(fs::read_to_string(&path).unwrap().contains(">Other<"));
    let (_, notes, status) =
        run(folder.path(), &["views", "out", "--view", "Costs / all", "--plots", "pdf", "--out", "plots"]);
    assert_eq!(status, 0, "{notes}");
    assert!(fs::read(folder.path().join("plots/Costs _ all.pdf")).unwrap().starts_with(b"%PDF"));
    // A second run prints the same text.
    assert_eq!(run(folder.path(), &["views", "out", "--format", "csv"]).0, text);
}

#[test]
fn the_six_metrics_need_no_views() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("05-puzzles");
    fs::create_dir(&out).unwrap();
    fs::write(out.join("One.json"), format!("[{}]", row("One", 2, 0, "4"))).unwrap();
    let (text, notes, status) = run(folder.path(), &["views", "05-puzzles", "--six", "paper"]);
    assert_eq!(status, 0, "{notes}");
    assert!(text.contains("Cooperation") && text.contains("1.00"), "{text}");
    assert!(notes.contains("Scalability: no folder with `warehouse` in its name"), "{notes}");
    assert!(!out.join("views").exists());
}

#[test]
fn a_failing_view_does_not_stop_the_others() {
    let folder = results();
    let config = "results_views:\n  A: {type: plot, x: num_agents, y: makespan}\n  B: {type: tabular}\n";
    fs::write(folder.path().join("two.yaml"), config).unwrap();
    let (text, error, status) = run(folder.path(), &["views", "out", "--config", "two.yaml"]);
    assert_eq!(status, 2);
    assert!(text.contains("16"), "{text}");
    assert!(
        error.contains("error: view `A`: `y` is `makespan`, expected a metric of the results"),
        "{error}"
    );
}

#[test]
fn paths_in_a_view_are_relative_to_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let view = "results_views:\n  A: {type: published, file: means.csv, setting: MAPF, algorithm: LaCAM, \
                dataset: 01-random, metrics: CSR}\n";
    let suite =
        "environment: {name: Environment, on_target: nothing, seed: 1}\nalgorithms: {Stay: {name: stay}}\n";
    let means = "setting,dataset,algorithm,num_agents,CSR\nMAPF,01-random,LaCAM,1,0.5\n";
    fs::create_dir(folder.path().join("paper")).unwrap();
    for (name, text) in [("suite.yaml", format!("{suite}{view}")), ("views.yaml", view.into())] {
        fs::write(folder.path().join("paper").join(name), text).unwrap();
    }
    fs::write(folder.path().join("paper/means.csv"), means).unwrap();
    assert_eq!(run(folder.path(), &["evaluate", "paper/suite.yaml", "--out", "out", "--html"]).2, 0);
    for more in [&[][..], &["--config", "paper/views.yaml"]] {
        let (text, notes, status) =
            run(folder.path(), &[&["views", "out", "--format", "csv"], more].concat());
        assert_eq!(status, 0, "{notes}");
        assert_eq!(text, "Number of Agents,Episodes,CSR,CSR published,CSR ratio\n1,1,0,0.5,0");
    }
    let page = fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(page.contains("CSR published"));
}

#[test]
fn errors_are_reported_in_one_line() {
    let folder = results();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    for name in ["empty", "broken", "foreign", "other"] {
        fs::create_dir(folder.path().join(name)).unwrap();
        write(&format!("{name}/suite.yaml"), SUITE);
    }
    let whole = format!("[{}]", row("One", 8, 0, "1"));
    write("broken/One.json", &whole[..whole.len() / 2]);
    write("foreign/One.json", "{\"results\": []}");
    write("other/One.json", &whole.replace("\"One\"", "\"Two\""));
    write("unknown.yaml", "results_views:\n  A:\n    type: tabular\n    drop_key: [seed]\n");
    write("type.yaml", "results_views:\n  A: {type: tabel}\n");
    write("none.yaml", "environment: 1\n");
    for (arguments, part) in [
        (vec!["nowhere", "--six", "paper"], "nowhere: No such file"),
        (
            vec!["nowhere"],
            "no views: expected `nowhere/suite.yaml`, `nowhere/nowhere.yaml`, or another file as `config`",
        ),
        (vec!["empty"], "no results in `empty`"),
        (vec!["out", "./out"], "`out` and `./out` are the same folder of results"),
        (vec!["broken"], "EOF while parsing"),
        (vec!["foreign"], "foreign/One.json: expected a list of results"),
        (vec!["other"], "row 1 has the algorithm `Two`, expected `One`"),
        (vec!["out", "--config", "unknown.yaml"], "unknown.yaml: line 4: unknown key `drop_key` in view `A`"),
        (vec!["out", "--config", "unknown.yaml"], "did you mean `drop_keys`?"),
        (vec!["out", "--config", "type.yaml"], "line 2: `A.type` is `tabel`, expected one of"),
        (vec!["out", "--config", "none.yaml"], "none.yaml: expected a field `results_views`"),
        (vec!["out", "--view", "Table2"], "no view `Table2`; did you mean `Table1`?"),
        (vec!["out", "--out", "unknown.yaml"], "unknown.yaml: File exists"),
    ] {
        let (_, error, status) = run(folder.path(), &[vec!["views"], arguments.clone()].concat());
        let lines: Vec<&str> = error.lines().filter(|line| !line.starts_with("note: ")).collect();
        assert_eq!((status, lines.len()), (2, 1), "{arguments:?}: {error}");
        assert!(lines[0].contains(part), "{arguments:?}: {error}");
    }
}
