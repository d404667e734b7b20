//! Errors in map files are reported in one line, with their place.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::io::{Cursor, Write};

use pogema_core::{Cell, Error, Map};
use pogema_maps::files::{MovingAiOptions, read_maps};
use pogema_maps::formats::{
    Scenario, Task, Water, read_archive, read_movingai, read_scen, read_set, without_outermost_cells,
    write_archive, write_scen,
};
use pogema_maps::generators::{Bays, Maze, MazeRanges, Preset, RandomMap, RandomRanges, Warehouse};
use pogema_maps::{MapText, Targets, parse_map_text, tiles};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

fn error_line<T: std::fmt::Debug>(result: Result<T, Error>) -> String {
    let line = result.unwrap_err().to_string();
    assert!(!line.contains('\n') && line.len() < 400, "{line}");
    line
}

#[track_caller]
fn assert_error<T: std::fmt::Debug>(result: Result<T, Error>, parts: &[&str]) {
    let line = error_line(result);
    for part in parts {
        assert!(line.contains(part), "`{part}` is not in: {line}");
    }
}

const HEADER: &str = "type octile\nheight 2\nwidth 3\nmap\n";

#[test]
fn invalid_movingai_maps_are_rejected() {
    let read = |text: &str| read_movingai(text, Water::Free);
    assert_error(read(""), &["line 1", "found ``, expected `type octile`"]);
    assert_error(read("type octile\nheight 2\nwidth 3\n...\n"), &["line 4", "`map`"]);
    assert_error(read("type octile\nheight two\nwidth 3\nmap\n"), &["line 2, column 8", "`two`"]);
    assert_error(read("type octile\nheight 0\nwidth 3\nmap\n"), &["line 2", "`0`", "1 to 65279"]);
    assert_error(read("type octile\nheight 2\nheight 2\nmap\n"), &["line 3", "found `height 2`"]);
    assert_error(read(&format!("{HEADER}...\n")), &["line 6", "row 2 is missing"]);
    assert_error(read(&format!("{HEADER}...\n..\n")), &["line 6, column 3", "2 cells"]);
    assert_error(read(&format!("{HEADER}....\n...\n")), &["line 5, column 4", "longer"]);
    assert_error(read(&format!("{HEADER}...\n.x.\n")), &["line 6, column 2", "`x`"]);
    assert_error(read(&format!("{HEADER}..\t\n...\n")), &["line 5, column 3", "the row has 2 cells"]);
    assert_error(read(&format!("{HEADER}...\n...\n...\n")), &["line 7", "another row"]);
    let high = "type octile\nheight 99999999999999999999\nwidth 1\nmap\n";
    assert_error(read(high), &["line 2, column 8", "`99999999999999999999`", "1 to 65279"]);
    let endless = format!("type octile\nheight 1\nwidth 3\nmap\n{}", ".".repeat(100_000_000));
    assert_error(read(&endless), &["line 5, column 4", "longer than the 3 cells"]);
}

#[test]
fn invalid_scen_files_are_rejected() {
    assert_error(read_scen(""), &["line 1", "version 1"]);
    assert_error(read_scen("version 2\n"), &["`version 2`"]);
    let line = |text: &str| read_scen(&format!("version 1\n{text}\n"));
    assert_error(line("1\tm\t3\t3\t0\t0\t1"), &["line 2", "7 columns"]);
    assert_error(line("1\tm\t3\t3\t3\t0\t1\t1\t2"), &["line 2, column 9", "start x is `3`", "0 to 2"]);
    assert_error(line("1\tm\tx\t3\t0\t0\t1\t1\t2"), &["line 2, column 5", "map width is `x`", "1 to 65279"]);
    assert_error(line("1\tm\t3\t0\t0\t0\t1\t1\t2"), &["line 2, column 7", "map height is `0`"]);
    assert_error(line("1\tm\t3\t3\t0\t0\t1\t1\tfar"), &["optimal length is `far`"]);
    assert_error(line("1\tm\t3\t3\t0\t0\t1\t1\tNaN"), &["`NaN`"]);
    let map = Map::from_rows(&["....", "...."]).unwrap();
    let tasks = read_scen("version 1\n1 m 3 3 0 0 1 1 2\n").unwrap();
    assert_error(Scenario::from_tasks(&tasks, &map), &["`m`", "3 rows", "4"]);
    let (start, goal) = (Cell::new(0, 0), Cell::new(0, 1));
    let task = Task { bucket: 0, map: "a\tb".into(), height: 2, width: 2, start, goal, length: 1.0 };
    assert_error(write_scen(&[task]), &["cannot be the name"]);
}

#[test]
fn invalid_map_sets_are_rejected() {
    assert_eq!(read_set("").unwrap(), []);
    assert_error(read_set("- a\n"), &["line 1, column 1", "expected mapping start"]);
    assert_error(read_set("one: |-\n  ..\n  .?\n"), &["map: line 3, column 4", "`one`", "`?`"]);
    assert_error(read_set("one: |-\n  ..\n  ...\n"), &["line 3, column 5", "`one`", "the row has 3 cells"]);
    assert_error(read_set("one: ..\ntwo: [1]\n"), &["line 2, column 6", "expected string scalar"]);
    let duplicate = |place: &str, name: &str| {
        Err(Error::request(format!("map set: line 2, column {place}: duplicate key `{name}`")))
    };
    assert_eq!(read_set("one: ..\none: ..\n"), duplicate("1", "one"));
    // The YAML parser tells these two keys apart.
    assert_eq!(read_set("1: ..\n\"1\": ..\n"), duplicate("6", "1"));
    assert_error(read_set("one: |-\n\t..\n"), &["line 1, column 6", "tab"]);
    assert_error(read_set("one: a.\n"), &["line 1", "`one`", "equal numbers"]);
    assert_error(
        read_set("one: \"\u{feff}..\"\n"),
        &["line 1, column 7", "`one`", "unknown character `\u{feff}`"],
    );
    let bomb = "a: &a [x,x,x,x,x,x,x,x,x]\nb: &b [*a,*a,*a,*a,*a,*a,*a,*a,*a]\nc: &c [*b,*b,*b,*b,*b,*b,*b,*b,*b]\n\
                d: &d [*c,*c,*c,*c,*c,*c,*c,*c,*c]\ne: &e [*d,*d,*d,*d,*d,*d,*d,*d,*d]\n\
                f: &f [*e,*e,*e,*e,*e,*e,*e,*e,*e]\ng: &g [*f,*f,*f,*f,*f,*f,*f,*f,*f]\n";
    // A list is rejected before its aliases are expanded.
    assert_error(read_set(bomb), &["line 1, column 7", "expected string scalar"]);
}

fn archive(entries: &[(&str, &[u8])]) -> Cursor<Vec<u8>> {
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in entries {
        writer.start_file(*name, SimpleFileOptions::default()).unwrap();
        writer.write_all(bytes).unwrap();
    }
    writer.finish().unwrap()
}

#[test]
fn invalid_archives_are_rejected() {
    let read = |entries: &[(&str, &[u8])]| read_archive(archive(entries), Water::Free);
    let good: &[u8] = b"type octile\nheight 1\nwidth 2\nmap\n..\n";
    assert_eq!(read(&[("maps/one.map", good), ("readme.txt", b"not a map")]).unwrap().len(), 1);
    assert_eq!(read(&[("ONE.MAP", good), ("__MACOSX/._ONE.MAP", b"\xff")]).unwrap()[0].name, "ONE");
    assert_error(
        read_archive(Cursor::new(b"not an archive".to_vec()), Water::Free),
        &["archive: invalid Zip archive"],
    );
    let whole = archive(&[("one.map", good)]).into_inner();
    let half = Cursor::new(whole[..whole.len() / 2].to_vec());
    assert_error(read_archive(half, Water::Free), &["archive: invalid Zip archive"]);
    assert_error(read(&[("../one.map", good)]), &["../one.map", "outside"]);
    assert_error(read(&[("/etc/one.map", good)]), &["one.map", "outside"]);
    assert_error(read(&[("a/one.map", good), ("b/one.map", good)]), &["b/one.map", "second map"]);
    assert_error(read(&[("one.map", b"type\n")]), &["one.map", "line 1"]);
    assert_error(read(&[("one.map", b"\xff\xfe")]), &["one.map", "utf-8"]);
    let map = Map::from_rows(&["."]).unwrap();
    assert_error(write_archive([("a/b", &map)]), &["not a file name"]);
    assert_error(write_archive([("a", &map), ("a", &map)]), &["Duplicate filename: a.map"]);
}

#[test]
fn files_without_maps() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let read = |name: &str| read_maps(&path(name), MovingAiOptions::default());
    std::fs::write(path("no.zip"), archive(&[("readme.txt", b"not a map")]).into_inner()).unwrap();
    std::fs::write(path("no.yaml"), "# No map yet.\n").unwrap();
    for name in ["no.zip", "no.yaml"] {
        assert_error(read(name), &[name, "no map in this file"]);
    }
    std::fs::create_dir(path("maps")).unwrap();
    std::fs::write(path("maps/._one.map"), b"\xff").unwrap();
    assert_error(read("maps"), &["no map in this folder"]);
    std::fs::write(path("maps/ONE.MAP"), "type octile\nheight 1\nwidth 2\nmap\n..\n").unwrap();
    assert_eq!(read("maps").unwrap().len(), 1);
}

#[test]
fn archives_that_unpack_to_too_many_bytes() {
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    let dots = vec![b'.'; 1 << 24];
    writer.start_file("one.map", SimpleFileOptions::default().large_file(true)).unwrap();
    for _ in 0..17 {
        writer.write_all(&dots).unwrap();
    }
    let bomb = writer.finish().unwrap();
    assert!(bomb.get_ref().len() < 1 << 22);
    assert_error(read_archive(bomb, Water::Free), &["one.map", "256 MiB"]);
}

#[test]
fn generator_settings_out_of_range_are_rejected() {
    let random = RandomMap { width: 5, height: 5, obstacle_density: 0.5, seed: 1 };
    assert_error(RandomMap { width: 0, ..random }.generate(), &["width", "`0`"]);
    assert_error(RandomMap { height: 1 << 40, ..random }.generate(), &["height"]);
    assert_error(RandomMap { obstacle_density: 1.1, ..random }.generate(), &["obstacle_density"]);
    assert_error(RandomMap { obstacle_density: f64::NAN, ..random }.generate(), &["obstacle_density"]);
    let ranges = RandomRanges::default();
    assert_error(RandomRanges { width_max: 3, ..ranges }.sample(0), &["width_min", "`17`", "3"]);
    assert_error(RandomRanges { obstacle_density_max: 0.0, ..ranges }.sample(0), &["obstacle_density_min"]);
    let infinite = RandomRanges { obstacle_density_max: f64::INFINITY, ..ranges }.sample(0);
    assert_error(infinite, &["`obstacle_density_max` is `inf`, expected a finite number"]);
    let wide = RandomRanges { width_max: i64::MAX, ..ranges }.sample(0);
    assert_error(wide, &["`width_max` is `9223372036854775807`, expected below 2^63 - 1"]);
    let maze =
        Maze { width: 9, height: 9, obstacle_density: 1.0, wall_components: 4, go_straight: 0.8, seed: 1 };
    assert_error(Maze { height: -1, ..maze }.generate(), &["height", "`-1`"]);
    assert_error(Maze { go_straight: 1.5, ..maze }.generate(), &["go_straight", "`1.5`"]);
    assert_error(Maze { obstacle_density: f64::INFINITY, ..maze }.generate(), &["obstacle_density"]);
    assert_error(Maze { obstacle_density: 1e30, ..maze }.generate(), &["obstacle_density"]);
    // The quotient of two negative numbers is positive.
    let negative = Maze { wall_components: -1, ..maze };
    assert_error(Maze { obstacle_density: -1e30, ..negative }.generate(), &["obstacle_density"]);
    assert_eq!(Maze { obstacle_density: -1e30, ..maze }.generate().unwrap().num_free(), 81);
    assert_error(
        MazeRanges { go_straight_max: 0.1, ..MazeRanges::default() }.sample(0),
        &["go_straight_min"],
    );
    let warehouse = Warehouse::default();
    assert_error(Warehouse { vertical_gap: 1, ..warehouse }.generate(Bays::Toolbox), &["vertical_gap"]);
    assert_error(Warehouse { wall_width: usize::MAX, ..warehouse }.generate(Bays::None), &["wall_width"]);
    assert_error(
        Warehouse { walls_rows: 60_000, ..warehouse }.generate(Bays::None),
        &["walls_rows", "fewer"],
    );
    assert_error(
        Warehouse { walls_in_row: 60_000, ..warehouse }.generate(Bays::None),
        &["walls_in_row", "fewer"],
    );
    // The published map lacks its first and last row.
    let flat = Warehouse { walls_rows: 0, vertical_gap: 2, ..warehouse };
    assert_error(flat.generate(Bays::Published), &["walls_rows", "0 rows", "more"]);
    assert_error(Warehouse { vertical_gap: 1, ..flat }.generate(Bays::Published), &["vertical_gap"]);
    assert_error(Preset::by_name("validation-maze"), &["`validation-mazes`"]);
}

#[test]
fn maps_that_a_format_cannot_hold_are_rejected() {
    let map = Map::new(6, 10, vec![false; 60]).unwrap();
    let cells: Vec<Cell> = (0..27).map(|at| map.cell_at(at)).collect();
    let goals = Targets::Single(cells.clone());
    let crowd = MapText { starts: cells, goals, ..MapText::from(map.clone()) };
    assert_error(crowd.to_text(), &["26 agents", "27"]);
    let (start, goal) = (vec![Cell::new(0, 0)], Targets::Single(vec![Cell::new(0, 0)]));
    let both = MapText { starts: start, goals: goal, ..MapText::from(map.clone()) };
    assert_error(both.to_text(), &["`a` already"]);
    assert_error(tiles("city", &map, 4), &["`4`", "6 rows and 10 columns"]);
    assert_error(tiles("city", &map, 0), &["`0`"]);
    assert_error(without_outermost_cells(&Map::from_rows(&["..", ".."]).unwrap()), &["2 x 2"]);
}

#[test]
fn maps_that_would_not_survive_a_round_trip_as_text_are_rejected() {
    let plain = parse_map_text("..\n.#\n").unwrap();
    let cells =
        |cells: &[(u16, u16)]| cells.iter().map(|&(row, col)| Cell::new(row, col)).collect::<Vec<_>>();
    let lone = |starts: usize, goals: usize| MapText {
        starts: cells(&vec![(0, 0); starts]),
        goals: Targets::Single(cells(&vec![(0, 1); goals])),
        ..plain.clone()
    };
    assert_error(lone(1, 0).to_text(), &["targets_xy", "agents_xy", "goals of 1 agent,"]);
    // More goals than there are letters, or than fit 8 bits.
    for goals in [34, 300] {
        assert_error(lone(0, goals).to_text(), &["targets_xy", "agents_xy"]);
        assert_error(lone(goals, goals).to_text(), &["26 agents"]);
    }
    let sequences = Targets::Sequences(vec![cells(&[(0, 1), (1, 0)])]);
    assert_error(
        MapText { starts: cells(&[(0, 0)]), goals: sequences, ..plain.clone() }.to_text(),
        &["targets_xy", "goal sequences"],
    );
    let pools = |starts: &[(u16, u16)], goals: &[(u16, u16)]| MapText {
        pools: Some((cells(starts), cells(goals))),
        ..plain.clone()
    };
    assert_eq!(pools(&[(0, 0), (0, 1)], &[(1, 0)]).to_text().unwrap(), "@@\n$#");
    let free = [(0, 0), (0, 1), (1, 0)];
    assert_error(pools(&[(0, 1), (0, 0)], &free).to_text(), &["possible_agents_xy", "(0, 0) after (0, 1)"]);
    assert_error(pools(&free, &[(0, 1), (0, 1)]).to_text(), &["possible_targets_xy", "(0, 1) after (0, 1)"]);
    assert_error(pools(&free, &[(1, 1)]).to_text(), &["possible_targets_xy", "(1, 1), an obstacle"]);
    assert_error(pools(&free, &free).to_text(), &["possible_agents_xy", "all free cells"]);
    assert_error(
        MapText { starts: lone(1, 1).starts, goals: lone(1, 1).goals, ..pools(&[(0, 0)], &free) }.to_text(),
        &["possible_agents_xy", "beside starts and goals"],
    );
}

#[test]
fn inconsistent_scenarios_are_rejected() {
    assert_error(Scenario::from_yaml("agents_xy: [[0, 0]]"), &["targets_xy"]);
    assert_error(Scenario::from_yaml("agents_xy: [[0, 0]]\ntargets_xy: [[1]]"), &["targets_xy"]);
    assert_error(
        Scenario::from_yaml("agents_xy: [[0, 0]]\ntargets_xy: [[1, 1], [2, 2]]"),
        &["1 agent,", "2 agents"],
    );
    assert_error(Scenario::from_yaml("[1]"), &["agents_xy"]);
    let one = Scenario::from_yaml("agents_xy: [[0, 0]]\ntargets_xy: [[1, 1]]\nother: 3").unwrap();
    assert_error(one.truncated(2), &["num_agents", "`2`", "1"]);
}
