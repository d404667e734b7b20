//! Compares the generators and the choice of a map with a live pogema-toolbox 0.1.1.
//!
//! `POGEMA_ORACLE_PYTHON=python cargo test -p pogema-maps --test toolbox_live`

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail by panicking")]

use std::io::Write;
use std::process::{Command, Stdio};

use pogema_maps::Library;
use pogema_maps::MapText;
use pogema_maps::formats::NamedMap;
use pogema_maps::generators::{Bays, Maze, MazeRanges, RandomMap, RandomRanges, Warehouse};
use pogema_numpy::Generator;
use serde::Deserialize;
use serde_json::{Value, json};

const NUM_REQUESTS: usize = 300;

#[derive(Deserialize)]
struct Reply {
    version: String,
    answers: Vec<Value>,
}

fn ask_toolbox(requests: &[Value]) -> Vec<Value> {
    let python =
        std::env::var("POGEMA_ORACLE_PYTHON").unwrap_or_else(|_| panic!("POGEMA_ORACLE_PYTHON is not set"));
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/toolbox_live.py");
    let mut child = Command::new(python)
        .args(["-B", script])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(json!(requests).to_string().as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success());
    let reply: Reply = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(reply.version, "0.1.1");
    assert_eq!(reply.answers.len(), requests.len());
    reply.answers
}

/// Draws settings at random.
struct Draw(Generator);

impl Draw {
    fn whole(&mut self, lowest: i64, highest: i64) -> i64 {
        self.0.integers(lowest, highest + 1).unwrap()
    }

    fn share(&mut self, lowest: f64, highest: f64) -> f64 {
        self.0.uniform(lowest, highest).unwrap()
    }
}

fn check(kind: &str, cases: Vec<(Value, String)>) {
    let requests: Vec<Value> = cases.iter().map(|(request, _)| request.clone()).collect();
    let answers = ask_toolbox(&requests);
    let num_distinct = answers.iter().collect::<std::collections::HashSet<_>>().len();
    assert!(num_distinct > cases.len() / 10, "{kind}: only {num_distinct} different answers");
    for ((request, ours), theirs) in cases.iter().zip(answers) {
        assert_eq!(theirs, json!(ours), "{kind}: {request}");
    }
}

fn rows(map: pogema_core::Map) -> String {
    MapText::from(map).to_text().unwrap()
}

#[test]
fn random_maps_match_the_toolbox() {
    let mut draw = Draw(Generator::seeded(1));
    let cases = (0..NUM_REQUESTS).map(|number| {
        let seed = number as u64 * 977;
        if number % 2 == 0 {
            let (width, height) = (draw.whole(1, 40), draw.whole(1, 40));
            let obstacle_density = draw.share(0.0, 1.0);
            let map = RandomMap { width, height, obstacle_density, seed }.generate().unwrap();
            let settings = json!({
                "width": width, "height": height, "obstacle_density": obstacle_density, "seed": seed
            });
            return (json!({"kind": "random", "settings": settings}), rows(map));
        }
        let ranges = RandomRanges {
            width_min: draw.whole(1, 12),
            width_max: draw.whole(12, 30),
            obstacle_density_max: draw.share(0.3, 0.9),
            ..RandomRanges::default()
        };
        let settings = json!({
            "width_min": ranges.width_min,
            "width_max": ranges.width_max,
            "obstacle_density_max": ranges.obstacle_density_max,
        });
        let map = ranges.sample(seed).unwrap().generate().unwrap();
        (json!({"kind": "random ranges", "settings": settings, "seed": seed}), rows(map))
    });
    check("random", cases.collect());
}

#[test]
fn mazes_match_the_toolbox() {
    let mut draw = Draw(Generator::seeded(2));
    let cases = (0..NUM_REQUESTS).map(|number| {
        let seed = number as u64 * 1013;
        if number % 2 == 0 {
            let maze = Maze {
                width: draw.whole(1, 40),
                height: draw.whole(1, 40),
                obstacle_density: draw.share(0.0, 1.5),
                wall_components: draw.whole(0, 12),
                // 0 and one half are special cases of the weights.
                go_straight: [0.0, 0.5, draw.share(0.0, 1.0)][number / 2 % 3],
                seed,
            };
            let settings = json!({
                "width": maze.width,
                "height": maze.height,
                "obstacle_density": maze.obstacle_density,
                "wall_components": maze.wall_components,
                "go_straight": maze.go_straight,
                "seed": seed,
            });
            return (json!({"kind": "maze", "settings": settings}), rows(maze.generate().unwrap()));
        }
        let ranges = MazeRanges {
            width_min: draw.whole(1, 12),
            width_max: draw.whole(12, 30),
            wall_components_max: draw.whole(1, 20),
            ..MazeRanges::default()
        };
        let settings = json!({
            "width_min": ranges.width_min,
            "width_max": ranges.width_max,
            "wall_components_max": ranges.wall_components_max,
        });
        let map = ranges.sample(seed).unwrap().generate().unwrap();
        (json!({"kind": "maze ranges", "settings": settings, "seed": seed}), rows(map))
    });
    check("mazes", cases.collect());
}

#[test]
fn warehouses_match_the_toolbox() {
    let mut draw = Draw(Generator::seeded(3));
    let mut size = |lowest: i64, highest: i64| draw.whole(lowest, highest) as usize;
    let cases = (0..NUM_REQUESTS).map(|number| {
        let with_bays = number % 2 == 1;
        let warehouse = Warehouse {
            wall_width: size(1, 8),
            wall_height: size(1, 4),
            walls_in_row: size(1, 4),
            walls_rows: size(1, 5),
            bottom_gap: size(0, 8),
            horizontal_gap: size(0, 3),
            vertical_gap: size(if with_bays { 2 } else { 1 }, 5),
        };
        let settings = json!({
            "wall_width": warehouse.wall_width,
            "wall_height": warehouse.wall_height,
            "walls_in_row": warehouse.walls_in_row,
            "walls_rows": warehouse.walls_rows,
            "bottom_gap": warehouse.bottom_gap,
            "horizontal_gap": warehouse.horizontal_gap,
            "vertical_gap": warehouse.vertical_gap,
        });
        let (kind, bays) = if with_bays { ("bays", Bays::Toolbox) } else { ("shelves", Bays::None) };
        let text = warehouse.generate(bays).unwrap().to_text().unwrap();
        (json!({"kind": kind, "settings": settings}), text)
    });
    check("warehouses", cases.collect());
}

#[test]
fn the_map_that_a_seed_chooses_matches_the_toolbox() {
    let names = ["a", "ab", "b", "maze-1", "maze-10", "maze-2", "Maze-3", "random-1", "x.y", "xzy", "a|b"];
    let mut library = Library::empty();
    let map = |name: &str| NamedMap {
        name: name.into(),
        text: MapText::from(pogema_core::Map::from_rows(&["....", "...."]).unwrap()),
    };
    library.register(names.into_iter().map(map));
    let maps: serde_json::Map<String, Value> =
        names.into_iter().map(|name| (name.into(), "....\n....".into())).collect();
    let patterns = ["a", "a|b", ".*", "maze-.*", "maze-[0-9]", "x.y", r"x\.y", "(?i:maze)-.*", "none", "a.?"];
    let mut cases = Vec::new();
    for pattern in patterns {
        for seed in 0..20 {
            let ours = library.choose(pattern, seed).ok().map(|(name, _)| name.to_owned());
            let settings = json!({"maps": maps, "pattern": pattern, "seed": seed});
            cases.push((json!({"kind": "choice", "settings": settings}), ours));
        }
    }
    let requests: Vec<Value> = cases.iter().map(|(request, _)| request.clone()).collect();
    for ((request, ours), theirs) in cases.iter().zip(ask_toolbox(&requests)) {
        assert_eq!(theirs, json!(ours), "{request}");
    }
    assert!(cases.iter().any(|(_, ours)| ours.is_none()));
}
