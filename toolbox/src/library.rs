//! The maps available to a suite.

use std::path::PathBuf;

use pogema_core::Error;
use pogema_maps::Library;
use pogema_maps::files::{MovingAiOptions, read_maps};
use serde_json::Value;

use crate::suite::Suite;

impl Suite {
    /// Collects the maps available to the suite, with a warning for each map that replaces another one.
    ///
    /// The available maps are:
    /// - the built-in maps;
    /// - the maps of a `maps.yaml` next to the suite, of the suite's files and of further files;
    /// - the maps of the paper's generators that the suite names.
    ///
    /// # Errors
    /// If a file cannot be read.
    pub fn library(&self, further: &[PathBuf]) -> Result<(Library, Vec<String>), Error> {
        let (mut library, mut warnings) = (Library::built_in(), Vec::new());
        let beside = self.path.with_file_name("maps.yaml");
        let beside = (beside.exists() && !self.maps.contains(&beside)).then_some(beside);
        for path in beside.iter().chain(&self.maps).chain(further) {
            let replaced = library.register(read_maps(path, MovingAiOptions::default())?);
            let path = path.display();
            let warning = |name| format!("{path}: a second map named `{name}` replaces the first");
            warnings.extend(replaced.into_iter().map(warning));
        }
        let names = self.environments.values_of("map_name");
        library.add_published(names.into_iter().filter_map(Value::as_str))?;
        Ok((library, warnings))
    }
}
