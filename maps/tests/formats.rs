//! Tests of map formats (mostly round trips), of tiles, and of the library of built-in, registered and published maps.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::BTreeSet;
use std::io::Cursor;

use pogema_core::{Cell, Map};
use pogema_maps::formats::{
    NamedMap, Scenario, Task, Water, read_archive, read_movingai, read_scen, read_set,
    without_outermost_cells, write_archive, write_movingai, write_scen, write_set,
};
use pogema_maps::generators::Preset;
use pogema_maps::{GridConfig, Library, MapText, Targets, parse_map_text, tiles};
use proptest::collection::vec;
use proptest::prelude::*;
use serde_json::Value;

fn any_map() -> impl Strategy<Value = Map> {
    (1_usize..12, 1_usize..12).prop_flat_map(|(height, width)| {
        vec(any::<bool>(), height * width).prop_map(move |cells| Map::new(height, width, cells).unwrap())
    })
}

/// A map text with letters, with pools, or with neither.
fn any_text() -> impl Strategy<Value = MapText> {
    (any_map(), 0_usize..3, any::<u64>()).prop_map(|(map, kind, seed)| {
        let free: Vec<Cell> = map.free_cells().collect();
        let mut mixed = free.clone();
        pogema_numpy::Generator::seeded(seed).shuffle(&mut mixed);
        let plain = MapText::from(map);
        match kind {
            0 => plain,
            1 => {
                let num_agents = (mixed.len() / 2).min(26);
                let (starts, goals) =
                    (mixed[..num_agents].to_vec(), mixed[num_agents..2 * num_agents].to_vec());
                MapText { starts, goals: Targets::Single(goals), ..plain }
            }
            _ => {
                let half: BTreeSet<Cell> = mixed.iter().take(mixed.len() / 2).copied().collect();
                let is_pool = !half.is_empty() && half.len() < free.len();
                let starts = free.iter().copied().filter(|cell| half.contains(cell)).collect();
                let goals = free.iter().copied().filter(|cell| cell.col % 2 == 0).collect();
                MapText { pools: is_pool.then_some((starts, goals)), ..plain }
            }
        }
    })
}

fn any_name() -> impl Strategy<Value = String> {
    prop_oneof!["[a-zA-Z0-9_-]{1,12}", "[ -~]{1,8}", "\\PC{1,5}"]
}

fn any_task() -> impl Strategy<Value = Task> {
    (1_usize..300, 1_usize..300, any::<[u16; 4]>(), 0.0..1e6_f64, any::<u64>()).prop_map(
        |(height, width, at, length, bucket)| {
            let cell = |row: u16, col: u16| Cell::new(row % height as u16, col % width as u16);
            let (start, goal) = (cell(at[0], at[1]), cell(at[2], at[3]));
            Task { bucket, map: "a city.map".into(), height, width, start, goal, length }
        },
    )
}

proptest! {
    #[test]
    fn map_texts_survive_a_round_trip(text in any_text()) {
        prop_assert_eq!(parse_map_text(&text.to_text().unwrap()).unwrap(), text);
    }

    #[test]
    fn map_sets_survive_a_round_trip(maps in vec((any_name(), any_text()), 0..5)) {
        let mut maps: Vec<NamedMap> = maps.into_iter().map(|(name, text)| NamedMap { name, text }).collect();
        maps.dedup_by(|one, other| one.name == other.name);
        let names: BTreeSet<&String> = maps.iter().map(|map| &map.name).collect();
        prop_assume!(names.len() == maps.len());
        prop_assert_eq!(read_set(&write_set(&maps).unwrap()).unwrap(), maps);
    }

    #[test]
    fn movingai_maps_survive_a_round_trip(map in any_map()) {
        let text = write_movingai(&map);
        prop_assert_eq!(read_movingai(&text, Water::Free).unwrap(), map.clone());
        let on_windows = format!("\u{feff}{}", text.replace('\n', "\r\n"));
        prop_assert_eq!(read_movingai(&on_windows, Water::Obstacle).unwrap(), map);
    }

    #[test]
    fn tasks_survive_a_round_trip(tasks in vec(any_task(), 0..6)) {
        prop_assert_eq!(read_scen(&write_scen(&tasks).unwrap()).unwrap(), tasks);
    }

    #[test]
    fn archives_survive_a_round_trip(maps in vec(any_map(), 1..5)) {
        let named: Vec<(String, Map)> =
            maps.into_iter().enumerate().map(|(at, map)| (format!("map {at}"), map)).collect();
        let packed = write_archive(named.iter().map(|(name, map)| (name.as_str(), map))).unwrap();
        let unpacked = read_archive(Cursor::new(packed), Water::Free).unwrap();
        let unpacked: Vec<(String, Map)> =
            unpacked.into_iter().map(|NamedMap { name, text }| (name, text.map)).collect();
        prop_assert_eq!(unpacked, named);
    }

    #[test]
    fn scenarios_survive_a_round_trip_through_config_fields(text in any_text(), is_lifelong in any::<bool>()) {
        prop_assume!(!text.starts.is_empty());
        let goals = if is_lifelong {
            let goals = text.goals.first();
            Targets::Sequences(goals.iter().map(|&goal| vec![goal, goals[0]]).collect())
        } else {
            text.goals.clone()
        };
        let scenario = Scenario::new(text.starts.clone(), goals).unwrap();
        let fields = Value::Object(scenario.fields());
        prop_assert_eq!(Scenario::from_yaml(&fields.to_string()).unwrap(), scenario.clone());
        let half = scenario.truncated(text.starts.len().div_ceil(2)).unwrap();
        prop_assert_eq!(&half.starts[..], &text.starts[..half.starts.len()]);
        prop_assert_eq!(half.goals.len(), half.starts.len());
        prop_assert!(scenario.truncated(text.starts.len() + 1).is_err());
    }

    #[test]
    fn tiles_hold_every_cell(side in 1_usize..5, down in 1_usize..4, across in 1_usize..4, seed in any::<u64>()) {
        let (height, width) = (side * down, side * across);
        let mut rng = pogema_numpy::Generator::seeded(seed);
        let cells = (0..height * width).map(|_| rng.integers(0, 2).unwrap() == 1).collect();
        let map = Map::new(height, width, cells).unwrap();
        let cut = tiles("city", &map, side).unwrap();
        prop_assert_eq!(cut.len(), down * across);
        for (number, tile) in cut.iter().enumerate() {
            prop_assert_eq!(&tile.name, &format!("city_{number:02}"));
            for index in 0..side * side {
                let cell = tile.text.map.cell_at(index);
                let (top, left) = (number / across * side, number % across * side);
                let there = Cell::new(cell.row + top as u16, cell.col + left as u16);
                prop_assert_eq!(tile.text.map.obstacles()[index], map.is_obstacle(there));
            }
        }
        prop_assert!(tiles("city", &map, height.max(width) + 1).is_err());
    }
}

#[test]
fn all_movingai_terrain_is_read() {
    let text = "type octile\nheight 2\nwidth 4\nmap\n.GSW\n@OTW\n";
    assert_eq!(read_movingai(text, Water::Free).unwrap().rows(), ["....", "###."]);
    assert_eq!(read_movingai(text, Water::Obstacle).unwrap().rows(), ["...#", "####"]);
    let framed = Map::from_rows(&["###", "#.#", "###"]).unwrap();
    assert_eq!(without_outermost_cells(&framed).unwrap().rows(), ["."]);
}

#[test]
fn x_is_the_column_in_scen_files() {
    let text = "version 1\n3\tcity.map\t20\t10\t15\t2\t0\t9\t15.5\n";
    let tasks = read_scen(text).unwrap();
    assert_eq!((tasks[0].height, tasks[0].width), (10, 20));
    assert_eq!((tasks[0].start, tasks[0].goal), (Cell::new(2, 15), Cell::new(9, 0)));
    let map = Map::new(10, 20, vec![false; 200]).unwrap();
    assert_eq!(Scenario::from_tasks(&tasks, &map).unwrap().starts, [Cell::new(2, 15)]);
}

#[test]
fn library_holds_built_in_and_registered_maps() {
    let mut library = Library::built_in();
    assert!(library.map("four-rooms").is_ok());
    assert_eq!(library.matching("puzzle-.*").unwrap().len(), pogema_maps::PUZZLES.len());
    let small = MapText::from(Map::from_rows(&["..."]).unwrap());
    let taken = library.register([
        NamedMap { name: "four-rooms".into(), text: small.clone() },
        NamedMap { name: "mine".into(), text: small.clone() },
    ]);
    assert_eq!(taken, ["four-rooms"]);
    assert_eq!(library.map("four-rooms").unwrap(), &small);
    let error = library.map("mime").unwrap_err().to_string();
    assert!(error.contains("`mine`"), "{error}");
    assert!(library.matching("(").unwrap_err().to_string().contains("regular expression"));
}

#[test]
fn published_maps_are_added_by_name_or_pattern() {
    let mut library = Library::built_in();
    let before = library.names().count();
    let names = ["validation-mazes-seed-005", "validation-random-seed-00.", "four-rooms", "(", "nothing"];
    library.add_published(names).unwrap();
    assert_eq!(library.names().count(), before + 11);
    let mazes = Preset::ValidationMazes.maps().unwrap();
    assert_eq!(library.map("validation-mazes-seed-005").unwrap(), &mazes[5].text);
    // Takes minutes if `add_published` searches for the nearest name for each of these names.
    let names: Vec<String> = Preset::TrainingMazes.names().map(|(_, name)| name).collect();
    library.add_published(names.iter().map(String::as_str)).unwrap();
    assert_eq!(library.names().count(), before + 11 + names.len());
    let mine = MapText::from(Map::from_rows(&["..."]).unwrap());
    let mut library = Library::empty();
    library.register([NamedMap { name: "wfi_warehouse".into(), text: mine.clone() }]);
    library.add_published(["wfi_warehouse"]).unwrap();
    assert_eq!(library.map("wfi_warehouse").unwrap(), &mine);
    let error = library.map("wfi_warehose").unwrap_err().to_string();
    assert!(error.contains("did you mean `wfi_warehouse`?"), "{error}");
    let error = Library::built_in().matching("validation-mazes-seed-5").unwrap_err().to_string();
    assert!(error.contains("did you mean `validation-mazes-seed-"), "{error}");
}

#[test]
fn unprintable_characters_of_names_are_escaped_in_sets() {
    let text = MapText::from(Map::from_rows(&["..."]).unwrap());
    let maps = [NamedMap { name: "a\u{1b}[2J\u{202e}b\n\u{9b}".into(), text }];
    let written = write_set(&maps).unwrap();
    assert_eq!(written, "\"a\\u001b[2J\\u202eb\\n\\u009b\": |-\n  ...\n");
    assert_eq!(read_set(&written).unwrap(), maps);
}

#[test]
fn letters_of_a_map_text_become_agents_xy() {
    let text = parse_map_text("a.#\n..A").unwrap();
    let config = GridConfig::from_yaml("map: |-\n  a.#\n  ..A\n").unwrap();
    assert_eq!(config.agents_xy, Some(text.starts));
}
