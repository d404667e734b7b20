//! Maps that come with the program, by name.

use pogema_core::{Error, Map};

use crate::config::nearest;

/// Each map and its name.
const MAPS: [(&str, &str); 1] = [("four-rooms", include_str!("../data/four-rooms.txt"))];

/// The names of all maps, in order.
pub fn map_names() -> impl Iterator<Item = &'static str> {
    MAPS.iter().map(|(name, _)| *name)
}

/// The map of a name.
///
/// # Errors
/// [`Error::Config`] with the nearest known name if there is none.
///
/// Rule: grid/named
pub fn named_map(name: &str) -> Result<Map, Error> {
    let Some((_, text)) = MAPS.iter().find(|(known, _)| *known == name) else {
        let hint = nearest(name, map_names()).unwrap_or_default();
        return Err(Error::config("map_name", name, format!("a known map; the nearest is `{hint}`")));
    };
    Map::from_rows(&text.split_whitespace().collect::<Vec<_>>())
}
