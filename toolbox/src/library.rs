//! The maps available to a suite.

use std::path::PathBuf;

use pogema_core::{Error, Words};
use pogema_maps::Library;
use pogema_maps::files::{Reading, read_maps};
use pogema_maps::generators::Preset;
use serde_json::Value;

use crate::suite::Suite;

impl Suite {
    /// Collects the maps available to the suite, with a warning for each map that replaces another one.
    ///
    /// These are the built-in maps, the maps of a `maps.yaml` next to the suite, of the suite's files and of further
    /// files, and the maps of the paper's generators that the suite names.
    ///
    /// # Errors
    /// If a file cannot be read.
    pub fn library(&self, further: &[PathBuf]) -> Result<(Library, Vec<String>), Error> {
        let (mut library, mut warnings) = (Library::built_in(), Vec::new());
        let beside = self.path.with_file_name("maps.yaml");
        let beside = (beside.exists() && !self.maps.contains(&beside)).then_some(beside);
        for path in beside.iter().chain(&self.maps).chain(further) {
            let replaced = library.register(read_maps(path, Reading::default())?);
            let path = path.display();
            let warning = |name| format!("{path}: a second map named `{name}` replaces the first");
            warnings.extend(replaced.into_iter().map(warning));
        }
        for preset in Preset::all() {
            if self.names_of(preset).any(|name| library.matching(name).is_err()) {
                let is_new = |name: &str| library.map(name).is_err();
                let maps: Vec<_> = preset.maps()?.into_iter().filter(|map| is_new(&map.name)).collect();
                library.register(maps);
            }
        }
        Ok((library, warnings))
    }

    /// Returns the names of maps that a generator may provide.
    fn names_of(&self, preset: Preset) -> impl Iterator<Item = &str> {
        let names = self.environments.values_of("map_name").into_iter().filter_map(Value::as_str);
        names.filter(move |name| name.contains(preset.word()))
    }
}
