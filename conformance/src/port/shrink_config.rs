//! Shrinking of configs from which a port draws its instances.

use pogema_maps::GridConfig;
use serde_json::Value;

use super::shrink::Shrinker;
use crate::request::Op;

impl Shrinker<'_, '_> {
    /// Shrinks the config: fewer fields and operations, smaller numbers and maps, and a smaller seed.
    pub fn shrink_config(&mut self) {
        loop {
            let before = self.best.request.clone();
            let Some(fields) = before.config.as_object() else { return };
            // Without a seed, every draw differs even if the port has no bug.
            let names: Vec<String> = fields.keys().filter(|name| *name != "seed").cloned().collect();
            for name in names {
                let mut simpler = self.best.request.clone();
                if let Some(fields) = simpler.config.as_object_mut() {
                    fields.remove(&name);
                }
                self.accept(&simpler);
            }
            for (name, values) in [
                ("num_agents", &[1, 2, 3, 4, 8][..]),
                ("size", &[2, 3, 4, 5, 6]),
                ("height", &[1, 2, 3, 4, 5]),
                ("width", &[1, 2, 3, 4, 5]),
                ("obs_radius", &[1, 2]),
                ("max_episode_steps", &[1, 2, 3, 4]),
                ("seed", &[0, 1, 2, 3, 4, 5]),
            ] {
                for &value in values {
                    if self.try_number(name, value) {
                        break;
                    }
                }
            }
            self.try_small_maps();
            self.try_smaller_map();
            for at in (1..self.best.request.ops.len()).rev() {
                let mut shorter = self.best.request.clone();
                shorter.ops.remove(at);
                self.accept(&shorter);
            }
            if self.best.request == before || self.is_done() {
                return;
            }
        }
    }

    /// Searches for a seed that shows the cause on a smaller generated map.
    fn try_small_maps(&mut self) {
        const MAX_SIDE: i64 = 4;
        const NUM_SEEDS: i64 = 24;
        let config = &self.best.request.config;
        let default = GridConfig::default().width as i64;
        let given = |name: &str| config.get(name).or(config.get("size")).and_then(Value::as_i64);
        let side = |name: &str| given(name).unwrap_or(default);
        let (height, width) = (side("height"), side("width"));
        if ["map", "map_name", "agents_xy", "possible_agents_xy"]
            .iter()
            .any(|field| config.get(field).is_some())
        {
            return;
        }
        let sides = (1..=MAX_SIDE).flat_map(|rows| (1..=MAX_SIDE).map(move |cols| (rows, cols)));
        let mut smaller: Vec<(i64, i64)> =
            sides.filter(|(rows, cols)| rows * cols < height * width).collect();
        smaller.sort_by_key(|(rows, cols)| (rows * cols, (rows - cols).abs()));
        for (rows, cols) in smaller {
            for seed in 0..NUM_SEEDS {
                let mut request = self.best.request.clone();
                if let Some(fields) = request.config.as_object_mut() {
                    fields.remove("size");
                }
                for (name, value) in [("height", rows), ("width", cols), ("seed", seed)] {
                    request.config[name] = value.into();
                }
                if self.accept(&request) {
                    return;
                }
            }
        }
    }

    /// Removes a row or column from a given map, and searches for a seed that shows the cause on the smaller map.
    fn try_smaller_map(&mut self) {
        const NUM_SEEDS: i64 = 24;
        let Some(map) = self.best.request.config.get("map").and_then(Value::as_str) else { return };
        for smaller in without_a_line(map) {
            for seed in 0..NUM_SEEDS {
                let mut request = self.best.request.clone();
                request.config["map"] = smaller.as_str().into();
                request.config["seed"] = seed.into();
                if self.accept(&request) {
                    return;
                }
            }
        }
    }

    fn try_number(&mut self, name: &str, value: i64) -> bool {
        let mut simpler = self.best.request.clone();
        let now = simpler.config.get(name).and_then(Value::as_i64);
        // Without a size, the generated map has the default size, which may be larger than necessary.
        let has_default_size =
            name == "size" && !simpler.config["map"].is_string() && simpler.config["height"].is_null();
        if now.map_or(!has_default_size, |now| now <= value) {
            return false;
        }
        simpler.config[name] = value.into();
        if name == "num_agents" {
            for op in &mut simpler.ops {
                if let Op::Step(actions) = op {
                    actions.truncate(value as usize);
                }
            }
        }
        self.accept(&simpler)
    }
}

/// Returns all map texts with one row or one column removed.
fn without_a_line(text: &str) -> Vec<String> {
    let rows: Vec<Vec<char>> = text.lines().map(|row| row.chars().collect()).collect();
    let width = rows.iter().map(Vec::len).max().unwrap_or(0);
    let written = |rows: Vec<Vec<char>>| {
        rows.into_iter().map(|row| row.into_iter().collect::<String>()).collect::<Vec<_>>().join("\n")
    };
    let without_row = |gone: usize| {
        let mut fewer = rows.clone();
        fewer.remove(gone);
        written(fewer)
    };
    let without_col = |gone: usize| {
        let mut narrower = rows.clone();
        for row in narrower.iter_mut().filter(|row| gone < row.len()) {
            row.remove(gone);
        }
        written(narrower)
    };
    (0..rows.len()).map(without_row).chain((0..width).map(without_col)).collect()
}
