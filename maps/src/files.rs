//! Reads maps and scenarios from files.

use std::io::Cursor;
use std::path::Path;

use crate::config::{FIELDS, GridConfig, value_from_yaml};
use crate::file_name::{extension, is_metadata};
use crate::formats::{
    NamedMap, Scenario, Water, read_archive, read_movingai, read_scen, read_set, without_outermost_cells,
};
use crate::text::{MapText, parse_map_text};
use pogema_core::files::{read_at_most, read_within};
use pogema_core::{Error, InputLimit};

/// Maximum size of a file: 256 MiB.
const LIMIT: u64 = 1 << 28;

/// Options for reading MovingAI maps.
#[derive(Clone, Copy, Debug, Default)]
pub struct MovingAiOptions {
    /// Whether water is free or an obstacle.
    pub water: Water,
    /// Whether the outermost cells are removed.
    pub strips_border: bool,
}

/// Reads all maps of a file, or of the map files of a folder in the order of their paths.
///
/// # Errors
/// [`Error::Io`] with the file and the reason, also if there is no map.
pub fn read_maps(path: &Path, options: MovingAiOptions) -> Result<Vec<NamedMap>, Error> {
    if !path.is_dir() {
        let maps = read_file(path, options)?;
        return if maps.is_empty() { Err(Error::io(path, "no map in this file")) } else { Ok(maps) };
    }
    let failed = |error: std::io::Error| Error::io(path, error);
    let mut files = Vec::new();
    for entry in std::fs::read_dir(path).map_err(failed)? {
        let file = entry.map_err(failed)?.path();
        let is_map_file = matches!(&*extension(&file), "yaml" | "yml" | "map" | "txt" | "zip");
        if is_map_file && !is_metadata(&file) && file.is_file() {
            files.push(file);
        }
    }
    files.sort();
    let mut maps = Vec::new();
    for file in files {
        maps.extend(read_file(&file, options)?);
    }
    if maps.is_empty() {
        return Err(Error::io(
            path,
            "no map in this folder, expected files ending in yaml, yml, map, txt or zip",
        ));
    }
    Ok(maps)
}

fn read_file(path: &Path, options: MovingAiOptions) -> Result<Vec<NamedMap>, Error> {
    let in_file = |error: Error| Error::io(path, error);
    let named = |text: MapText| vec![NamedMap { name: stem(path), text }];
    let stripped = |maps: Vec<NamedMap>| -> Result<Vec<NamedMap>, Error> {
        if !options.strips_border {
            return Ok(maps);
        }
        let strip = |map: NamedMap| {
            let text = MapText::from(without_outermost_cells(&map.text.map)?);
            Ok(NamedMap { text, ..map })
        };
        maps.into_iter().map(strip).collect()
    };
    match &*extension(path) {
        "zip" => {
            read_archive(Cursor::new(read_bytes(path)?), options.water).and_then(stripped).map_err(in_file)
        }
        "map" => {
            let map = read_movingai(&read_text(path)?, options.water).map_err(in_file)?;
            stripped(named(MapText::from(map))).map_err(in_file)
        }
        "yaml" | "yml" => read_yaml(path),
        _ => parse_map_text(&read_text(path)?).map(named).map_err(in_file),
    }
}

/// Reads a map set, or a config with a map.
fn read_yaml(path: &Path) -> Result<Vec<NamedMap>, Error> {
    let in_file = |error: Error| Error::io(path, error);
    let text = read_text(path)?;
    let value = value_from_yaml(&text).map_err(in_file)?;
    let is_config = value.as_object().is_some_and(|fields| {
        fields.contains_key("map") && fields.keys().all(|key| FIELDS.contains(&key.as_str()))
    });
    if !is_config {
        return read_set(&text).map_err(in_file);
    }
    let config = GridConfig::from_value(&value).map_err(in_file)?;
    let Some(map) = config.map else { return Err(Error::io(path, "the config has no map")) };
    let (starts, goals) = (config.agents_xy.unwrap_or_default(), config.targets_xy.unwrap_or_default());
    let Scenario { starts, goals } = Scenario::new(starts, goals).map_err(in_file)?;
    let pools = match (config.possible_agents_xy, config.possible_targets_xy) {
        (Some(starts), Some(goals)) => Some((starts, goals)),
        (None, None) => None,
        (starts, _) => {
            let [missing, given] = if starts.is_some() {
                ["possible_targets_xy", "possible_agents_xy"]
            } else {
                ["possible_agents_xy", "possible_targets_xy"]
            };
            let expected = format!("a list of cells, because `{given}` is given");
            return Err(in_file(Error::config(missing, "null", expected)));
        }
    };
    let text = MapText { map, starts, goals, pools };
    Ok(vec![NamedMap { name: stem(path), text }])
}

/// Reads the starts and goals of a scenario file and checks that they are on the map.
///
/// The file is a MovingAI `.scen` file, or a YAML file with `agents_xy` and `targets_xy`.
///
/// # Errors
/// [`Error::Io`] with the file and the reason, also if a start or goal is not on the map.
pub fn read_scenario(path: &Path, map: &pogema_core::Map) -> Result<Scenario, Error> {
    let text = read_text(path)?;
    let scenario = if extension(path) == "scen" {
        read_scen(&text).and_then(|tasks| Scenario::from_tasks(&tasks, map))
    } else {
        Scenario::from_yaml(&text)
    };
    scenario
        .and_then(|scenario| scenario.check_on(map).map(|()| scenario))
        .map_err(|error| Error::io(path, error))
}

/// Reads a file as text, without a leading byte order mark.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read, is larger than 256 MiB or is not UTF-8.
pub fn read_text(path: &Path) -> Result<String, Error> {
    text_of(path, read_bytes(path)?)
}

/// Reads a file as text within a limit, without a leading byte order mark.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read, exceeds the limit or is not UTF-8.
pub fn read_text_within(path: &Path, limit: InputLimit) -> Result<String, Error> {
    let bytes = read_at_most(path, limit.largest_file())?;
    text_of(path, bytes.ok_or_else(|| Error::io(path, limit.file_error()))?)
}

fn text_of(path: &Path, bytes: Vec<u8>) -> Result<String, Error> {
    let text = String::from_utf8(bytes).map_err(|error| {
        let place = error.utf8_error().valid_up_to();
        Error::io(path, format!("byte {} is not UTF-8 text", place + 1))
    })?;
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}

fn read_bytes(path: &Path) -> Result<Vec<u8>, Error> {
    read_within(path, LIMIT)
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}
