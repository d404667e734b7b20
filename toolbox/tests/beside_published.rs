//! `type: published` and `type: ratios`: small artificial results compared with artificial published ones, and invalid
//! files.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::fs;
use std::path::Path;

use pogema_toolbox::views::{Format, Shown, View};
use pogema_toolbox::{Node, Pairs, Proof, Results, Row};

const MEANS: &str = "\
setting,dataset,algorithm,num_agents,n,CSR,SoC,avg_throughput,remark
MAPF,01-random,LaCAM,2,3,1,10,,none
MAPF,01-random,LaCAM,4,2,0.5,40,,none
MAPF,01-random,DCC,2,3,1,30,,none
MAPF,03-warehouse,LaCAM,2,2,1,8,,none
LMAPF,01-random,RHCR,2,3,,,0.5,none
";

const VIEW: &str = "{type: published, file: means.csv, setting: MAPF, algorithm: LaCAM, metrics: [CSR, SoC]}";

/// Returns a row of `LaCAM`. `settings` holds its varied fields as JSON. Without a cost, the row is unsolved.
fn row(set: &str, settings: &str, cost: Option<u64>) -> Row {
    let (csr, soc) = (u8::from(cost.is_some()), cost.unwrap_or(99));
    let text = format!(
        r#"{{"metrics": {{"CSR": {csr}, "SoC": {soc}, "runtime": {soc}, "avg_throughput": 0.75}},
            "env_grid_search": {settings}, "algorithm": "LaCAM"}}"#
    );
    Row { set: set.to_owned(), ..serde_json::from_str(&text).unwrap() }
}

fn of(num_agents: u64, seed: u64, cost: Option<u64>) -> Row {
    row("01-random", &format!(r#"{{"num_agents": {num_agents}, "seed": {seed}}}"#), cost)
}

fn results() -> Results {
    let proof = |lower_bound| Proof { lower_bound: Some(lower_bound), unsolvable: None };
    let unsolvable = Proof { lower_bound: None, unsolvable: Some("agents 0 and 1 block each other".into()) };
    let rows = vec![
        Row { proof: proof(8), ..of(2, 0, Some(9)) },
        Row { proof: proof(8), ..of(2, 1, Some(9)) },
        Row { proof: proof(8), ..of(2, 2, Some(9)) },
        Row { proof: proof(16), ..of(4, 0, Some(18)) },
        Row { proof: unsolvable, ..of(4, 1, None) },
    ];
    Results { rows, notes: Vec::new() }
}

/// Creates a folder with `means.csv`, and `episodes` with published rows of a dataset.
fn folder(means: &str, dataset: &str, rows: &[(&str, u64)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("means.csv"), means).unwrap();
    let episodes = folder.path().join("episodes").join(dataset);
    fs::create_dir_all(&episodes).unwrap();
    let rows: Vec<String> = rows
        .iter()
        .map(|(settings, cost)| {
            let metrics = format!(r#"{{"CSR": 1.0, "SoC": {cost}}}"#);
            format!(r#"{{"metrics": {metrics}, "env_grid_search": {settings}, "algorithm": "LaCAM"}}"#)
        })
        .collect();
    fs::write(episodes.join("LaCAM.json"), format!("[{}]", rows.join(","))).unwrap();
    folder
}

fn show(folder: &Path, fields: &str, results: &Results) -> Result<Shown, String> {
    let view = View::read("A", &Node::parse(fields).unwrap());
    let view = view.map(|view| view.beside(&folder.join("views.yaml")));
    view.and_then(|view| view.show("A", results, None)).map_err(|error| error.to_string())
}

fn csv(shown: &Shown) -> Vec<String> {
    shown.tables[0].text(Format::Csv).lines().map(str::to_owned).collect()
}

#[test]
fn without_episodes_costs_are_compared_if_all_instances_are_solved() {
    let folder = folder(MEANS, "01-random", &[]);
    let shown = show(folder.path(), VIEW, &results()).unwrap();
    assert_eq!(
        csv(&shown),
        [
            "Number of Agents,Episodes,CSR,CSR published,CSR ratio,SoC,SoC published,SoC ratio,SoC at least",
            "2,3,1,1,1,9,10,0.9,0.8",
            "4,2,0.5,0.5,1,18,,,",
        ]
    );
    let text = shown.tables[0].text(Format::Markdown);
    assert!(text.contains("| 1.0000 |        1.0000 |    1.0000 |  9.00 |         10.00 |"), "{text}");
    assert!(text.ends_with("`LaCAM` compared with the published `LaCAM`, MAPF"), "{text}");
    let [compared, unsolvable] = &shown.notes[..] else { panic!("{:?}", shown.notes) };
    assert!(compared.starts_with("`01-random` with 4 agents: `SoC` is not compared"), "{compared}");
    let expected = "01-random, num_agents=4, seed=1: proved unsolvable: agents 0 and 1 block each other";
    assert_eq!(unsolvable, expected);
}

#[test]
fn costs_without_a_published_mean_produce_no_note() {
    let means = MEANS.replace("4,2,0.5,40,", "4,2,0.5,,");
    let folder = folder(&means, "01-random", &[]);
    let notes = show(folder.path(), VIEW, &results()).unwrap().notes;
    assert!(!notes.iter().any(|note| note.contains("is not compared")), "{notes:?}");
}

#[test]
fn with_episodes_costs_are_compared_on_the_instances_that_both_solve() {
    let published = [
        (r#"{"num_agents": 2, "seed": 0}"#, 10),
        (r#"{"num_agents": 2, "seed": 2}"#, 20),
        (r#"{"num_agents": 4, "seed": 0}"#, 20),
        (r#"{"num_agents": 4, "seed": 1}"#, 40),
    ];
    let folder = folder(MEANS, "01-random", &published);
    let fields = VIEW.replace("means.csv", "means.csv, episodes: episodes");
    let shown = show(folder.path(), &fields, &results()).unwrap();
    assert_eq!(csv(&shown)[1], format!("2,3,1,1,1,9,15,0.6,{}", 8.0 / 15.0));
    // The bound counts instances that the published algorithm solved; unsolvable instances have no bound.
    assert_eq!(csv(&shown)[2], "4,2,0.5,0.5,1,18,20,0.9,0.8");
    assert_eq!(shown.notes.len(), 1, "{:?}", shown.notes);
    let fields = fields.replace("CSR, SoC", "runtime");
    assert!(show(folder.path(), &fields, &results()).unwrap_err().contains("no column `runtime`"));
}

#[test]
fn ratios_have_a_column_for_each_algorithm_with_published_means() {
    let folder = folder(MEANS, "01-random", &[]);
    let mut results = results();
    results.rows.push(row("03-warehouse", r#"{"num_agents": 2}"#, Some(4)));
    let of_algorithm = |name: &str, cost| Row { algorithm: name.to_owned(), ..of(2, 0, Some(cost)) };
    results.rows.extend([of_algorithm("DCC", 60), of_algorithm("PIBT", 7)]);
    let fields = "{type: ratios, file: means.csv, setting: MAPF, metric: SoC}";
    let shown = show(folder.path(), fields, &results).unwrap();
    let expected =
        ["Folder,Number of Agents,DCC,LaCAM", "01-random,2,2,0.9", "01-random,4,,", "03-warehouse,2,,0.5"];
    assert_eq!(csv(&shown), expected);
    assert!(shown.tables[0].text(Format::Markdown).ends_with("SoC divided by the published mean, MAPF"));
    let note = "`SoC` is compared only where an algorithm solves all instances in both sources";
    assert_eq!(shown.notes, ["`PIBT`: no published means", note]);
    let shown = show(
        folder.path(),
        &fields.replace(
            "metric: SoC",
            "metric: CSR, rename_fields: {num_agents: agents}, rename_algorithms: {DCC: C}",
        ),
        &results,
    );
    assert_eq!(csv(&shown.unwrap())[0], "Folder,agents,C,LaCAM");
    for (fields, message) in [
        (
            fields.replace("MAPF, metric: SoC", "LMAPF"),
            "has no LMAPF means of DCC, LaCAM, PIBT in these folders",
        ),
        (fields.replace("SoC", "ISR"), "`metric` is `ISR`, expected a metric of the results"),
        (fields.replace("SoC", "runtime"), "means.csv: no column `runtime`"),
        (fields.replace("means.csv", "absent.csv"), "absent.csv: No such file"),
        (fields.replace("MAPF", "both"), "expected one of MAPF, LMAPF"),
    ] {
        let error = show(folder.path(), &fields, &results).unwrap_err();
        assert!(error.contains(message) && !error.contains('\n'), "{error}");
    }
}

#[test]
fn wrong_rows_of_means_are_rejected_with_their_line() {
    let row = "MAPF,01-random,LaCAM,4,2,0.5,40,,none\n";
    for (means, message) in [
        (
            MEANS.replace("LaCAM,4,2", "LaCAM,4.0,2"),
            "line 3: `num_agents` is `4.0`, expected a whole number or `all`",
        ),
        (
            MEANS.replace("LaCAM,4,2", "LaCAM,,2"),
            "line 3: `num_agents` is ``, expected a whole number or `all`",
        ),
        (
            format!("{MEANS}{row}"),
            "line 7: the row repeats the setting, dataset, algorithm, num_agents of line 3",
        ),
    ] {
        let folder = folder(&means, "01-random", &[]);
        let error = show(folder.path(), VIEW, &results()).unwrap_err();
        assert!(error.ends_with(message), "{error}");
    }
}

#[test]
fn means_over_all_numbers_of_agents_are_left_out() {
    let with_all = format!("{MEANS}MAPF,01-random,LaCAM,all,5,0.8,25,,none\n");
    let shown = [MEANS, &with_all].map(|means| {
        let folder = folder(means, "01-random", &[]);
        csv(&show(folder.path(), VIEW, &results()).unwrap())
    });
    assert_eq!(shown[0].len(), 3);
    assert_eq!(shown[0], shown[1]);
}

#[test]
fn folders_are_datasets_and_the_longest_time_is_shown() {
    let means = MEANS.replace("remark", "runtime").replace("none", "3");
    let folder = folder(&means, "01-random", &[]);
    let mut results = results();
    results.rows.push(row("03-warehouse", r#"{"num_agents": 2}"#, Some(4)));
    let fields = VIEW.replace("[CSR, SoC]", "runtime");
    let shown = show(folder.path(), &fields, &results).unwrap();
    let head = "Folder,Number of Agents,Episodes,Runtime (seconds),Runtime (seconds) published,Runtime (seconds) ratio,longest";
    assert_eq!(csv(&shown)[..2], [head.to_owned(), "01-random,2,3,9,3,3,9".to_owned()]);
    assert_eq!(csv(&shown)[3], format!("03-warehouse,2,1,4,3,{},4", 4.0 / 3.0));
    // If the view names a dataset, every folder is compared with this dataset.
    let fields = fields.replace("runtime", "SoC").replace("setting", "dataset: 03-warehouse, setting");
    let shown = show(folder.path(), &fields, &results).unwrap();
    assert!(csv(&shown)[1].starts_with("01-random,2,3,9,8,1.125"), "{:?}", csv(&shown));
}

#[test]
fn lifelong_results_are_compared_by_throughput() {
    let folder = folder(MEANS, "01-random", &[]);
    let fields =
        "{type: published, file: means.csv, setting: LMAPF, algorithm: RHCR, metrics: avg_throughput}";
    let shown = show(folder.path(), fields, &results()).unwrap();
    assert_eq!(csv(&shown)[1..], ["2,3,0.75,0.5,1.5", "4,2,0.75,,"]);
    let note = "`01-random` with 4 agents: no published means";
    assert_eq!(shown.notes[0], note);
}

/// Published rows do not name the map if there is only one, and results do not name a map that is not varied.
#[test]
fn fields_varied_in_the_published_rows_identify_instances() {
    let published = [(r#"{"num_agents": 2, "seed": 5}"#, 8)];
    let folder = folder(MEANS, "03-warehouse", &published);
    let fields = VIEW.replace("means.csv", "means.csv, episodes: episodes");
    let of = |settings: &str| row("03-warehouse", settings, Some(6));
    let named = of(r#"{"num_agents": 2, "seed": 5, "map_name": "wfi_warehouse"}"#);
    let fixed = Row {
        config: Pairs::from([("num_agents".into(), 2.into()), ("seed".into(), 9.into())]),
        ..of(r#"{"seed": 5}"#)
    };
    for row in [named.clone(), fixed] {
        let results = Results { rows: vec![row], notes: Vec::new() };
        let shown = show(folder.path(), &fields, &results).unwrap();
        assert_eq!(csv(&shown)[1], "2,1,1,1,1,6,8,0.75");
    }
    let other = of(r#"{"num_agents": 2, "seed": 5, "map_name": "another"}"#);
    let results = Results { rows: vec![named, other], notes: Vec::new() };
    assert_eq!(
        show(folder.path(), &fields, &results).unwrap_err(),
        "view `A`: `map_name` has 2 values in `03-warehouse` and is not varied in the published episodes"
    );
    let elsewhere = of(r#"{"num_agents": 2, "seed": 6}"#);
    let results = Results { rows: vec![elsewhere], notes: Vec::new() };
    let shown = show(folder.path(), &fields, &results).unwrap();
    assert_eq!(csv(&shown)[1], "2,1,1,1,1,");
    let note = "`03-warehouse` with 2 agents: none of the instances is among the published episodes";
    assert_eq!(shown.notes, [note]);
}

#[test]
fn wrong_names_and_wrong_cells_are_rejected() {
    let folder = folder(MEANS, "01-random", &[(r#"{"num_agents": 2}"#, 8)]);
    for (from, to, expected) in [
        ("means.csv", "mean.csv", "mean.csv: No such file"),
        ("MAPF", "MAPE", "`A.setting` is `MAPE`, expected one of MAPF, LMAPF; did you mean `MAPF`?"),
        ("setting: MAPF, ", "", "`A` lacks the field `setting`"),
        ("file", "fil", "unknown key `fil` in view `A`; did you mean `file`?"),
        ("LaCAM", "LaCam", "has no algorithm `LaCam` of MAPF, 01-random; did you mean `LaCAM`?"),
        ("LaCAM", "LaCAM, dataset: 01-randm", "no dataset `01-randm` of MAPF; did you mean `01-random`?"),
        ("LaCAM", "LaCAM, ours: LaCam", "view `A`: expected `ours`, one of LaCAM, found `LaCam`"),
        ("[CSR, SoC]", "[CSR, SOC]", "`metrics` is `SOC`, expected a metric of the results"),
        ("LaCAM", "DCC, episodes: episodes", "episodes/01-random` has no results of `DCC`"),
        ("LaCAM", "LaCAM, episodes: nowhere", "nowhere/01-random: No such file"),
    ] {
        assert!(VIEW.contains(from), "{from}");
        let error = show(folder.path(), &VIEW.replacen(from, to, 1), &results()).unwrap_err();
        assert!(error.contains(expected), "{to}: {error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
    for (from, to, expected) in [
        ("dataset,", "data,", "means.csv: no column `dataset`; did you mean `data`?"),
        ("SoC", "soc", "means.csv: no column `SoC`; did you mean `soc`?"),
        (",10,", ",ten,", "means.csv: line 2: `SoC` is `ten`, expected a number or an empty cell"),
        (",10,", ",NaN,", "means.csv: line 2: `SoC` is `NaN`, expected a number or an empty cell"),
        (",10,,none", ",10", "means.csv: CSV error: record 1 (line: 2"),
    ] {
        assert!(MEANS.contains(from), "{from}");
        fs::write(folder.path().join("means.csv"), MEANS.replacen(from, to, 1)).unwrap();
        let error = show(folder.path(), VIEW, &results()).unwrap_err();
        assert!(error.contains(expected), "{to}: {error}");
    }
    // Without `CSR`, the share of solved instances, no sum of costs can be compared.
    fs::write(folder.path().join("means.csv"), MEANS.replacen("CSR", "csr", 1)).unwrap();
    let error = show(folder.path(), &VIEW.replacen("[CSR, SoC]", "[SoC]", 1), &results()).unwrap_err();
    assert!(error.contains("means.csv: no column `CSR`"), "{error}");
}

#[test]
fn intervals_and_times_of_decisions_are_shown() {
    let folder = folder(MEANS, "01-random", &[]);
    let lifelong = |seed: u64, throughput: f64, runtime: f64, network: f64| {
        let text = format!(
            r#"{{"metrics": {{"avg_throughput": {throughput}, "runtime": {runtime},
                "network_time": {network}}}, "env_grid_search": {{"num_agents": 2, "seed": {seed}}}, "algorithm": "RHCR"}}"#
        );
        let config = Pairs::from([("max_episode_steps".to_owned(), 100.into())]);
        Row { set: "01-random".to_owned(), config, ..serde_json::from_str(&text).unwrap() }
    };
    let rows = vec![lifelong(0, 0.5, 0.5, 0.25), lifelong(1, 0.5, 0.75, 0.25)];
    let results = Results { rows, notes: Vec::new() };
    let fields = "{type: published, file: means.csv, setting: LMAPF, algorithm: RHCR, metrics: [avg_throughput], \
                  show_std: True, decision_times: True}";
    let shown = show(folder.path(), fields, &results).unwrap();
    // Without the network, the 200 decisions (100 steps of 2 agents) took 0.25 seconds in the first row and 0.5 in
    // the second.
    let expected = "2,2,0.5,0.5,0.5,2,0.5,1,1875,1250";
    assert_eq!(csv(&shown)[1], expected);
    // A planner has no network.
    let rows = results.rows.into_iter().map(|mut row| {
        row.metrics.shift_remove("network_time");
        row
    });
    let results = Results { rows: rows.collect(), notes: Vec::new() };
    let shown = show(folder.path(), fields, &results).unwrap();
    assert_eq!(csv(&shown)[1], "2,2,0.5,0.5,0.5,2,0.5,1,3125,");
    assert!(csv(&shown)[0].ends_with(",planner µs,network µs"), "{}", csv(&shown)[0]);
}
