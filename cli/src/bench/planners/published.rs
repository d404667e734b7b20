//! The paper's figures, to stand beside ours.

use std::collections::HashMap;
use std::path::Path;

use pogema_core::Error;
use pogema_maps::files::read_text;
use serde::Deserialize;

use super::suite::Setting;

/// The mean figures of one crowd.
#[derive(Clone, Debug, Deserialize)]
pub struct Mean {
    setting: String,
    dataset: String,
    algorithm: String,
    num_agents: String,
    #[serde(rename = "CSR")]
    pub csr: Option<f64>,
    #[serde(rename = "SoC")]
    pub soc: Option<f64>,
    pub makespan: Option<f64>,
    pub avg_throughput: Option<f64>,
    pub runtime: Option<f64>,
}

/// One episode as pogema-toolbox writes it.
#[derive(Debug, Deserialize)]
struct Episode {
    metrics: Figures,
    env_grid_search: Place,
}

#[derive(Debug, Deserialize)]
struct Figures {
    #[serde(rename = "CSR")]
    csr: f64,
    #[serde(rename = "SoC")]
    soc: f64,
}

#[derive(Debug, Deserialize)]
struct Place {
    #[serde(default)]
    seed: u64,
    num_agents: Option<usize>,
    map_name: Option<String>,
}

/// The published means of all sets.
pub struct Published {
    means: Vec<Mean>,
}

impl Published {
    /// Reads a table with a row for each setting, set, algorithm and crowd.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = read_text(path)?;
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let means = reader.deserialize().collect::<Result<_, _>>();
        Ok(Self { means: means.map_err(|error| Error::io(path, error))? })
    }

    /// The means of a crowd.
    pub fn mean(&self, setting: Setting, set: &str, algorithm: &str, num_agents: usize) -> Option<&Mean> {
        self.means.iter().find(|mean| {
            mean.setting == setting.name()
                && mean.dataset == set
                && mean.algorithm == algorithm
                && mean.num_agents == num_agents.to_string()
        })
    }
}

/// The sums of costs of the episodes of a set that a published algorithm solved, by agents, map and seed.
pub type Solved = HashMap<(usize, String, u64), f64>;

/// Reads the episodes of an algorithm on a set, in the toolbox's layout.
pub fn solved(path: &Path, only_map: Option<&str>) -> Result<Solved, Error> {
    let episodes: Vec<Episode> =
        serde_json::from_str(&read_text(path)?).map_err(|error| Error::io(path, error))?;
    let solved = episodes.into_iter().filter(|episode| episode.metrics.csr == 1.0);
    let entry = |Episode { metrics, env_grid_search: place }: Episode| {
        let map = place.map_name.or_else(|| only_map.map(str::to_owned))?;
        Some(((place.num_agents.unwrap_or(1), map, place.seed), metrics.soc))
    };
    Ok(solved.filter_map(entry).collect())
}
