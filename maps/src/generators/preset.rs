//! The paper's map sets under their published names.

use std::ops::Range;

use pogema_core::{Error, Words, words};

use super::{Bays, MazeRanges, RandomRanges, Warehouse};
use crate::config::did_you_mean;
use crate::formats::NamedMap;
use crate::text::MapText;

words! {
    /// A map set of the paper. The names of its maps begin with its own name, except for the warehouse.
    ///
    /// Source: pogema-toolbox 0.1.1, `random_generator.py`, `maze_generator.py` and `warehouse_generator.py`, `main`;
    /// the published sets, whose mazes have sides from 17 to 21 in place of the generator's 5 to 9
    pub enum Preset {
        /// 128 random maps for validation.
        ValidationRandom = "validation-random",
        /// 512 random maps for training.
        TrainingRandom = "training-random",
        /// 128 mazes for validation.
        ValidationMazes = "validation-mazes",
        /// 2048 mazes for training.
        TrainingMazes = "training-mazes",
        /// The warehouse.
        Warehouse = "warehouse",
    }
}

/// The seeds for training follow those for validation.
const SEEDS_OF_VALIDATION: Range<u64> = 0..128;
const SEEDS_OF_RANDOM_TRAINING: Range<u64> = 128..128 + 512;
const SEEDS_OF_MAZE_TRAINING: Range<u64> = 128..128 + 2048;

impl Preset {
    /// Returns the preset with a name.
    ///
    /// # Errors
    /// [`Error::Argument`] with all known names and the nearest one.
    pub fn by_name(name: &str) -> Result<Self, Error> {
        Self::of_word(name).ok_or_else(|| {
            let hint = did_you_mean(name, Self::NAMES.iter().copied());
            Error::argument("preset", name, format!("{}{hint}", Self::expected()))
        })
    }

    /// The ranges from which the settings of the paper's mazes are drawn.
    pub const MAZES: MazeRanges = MazeRanges {
        width_min: 17,
        width_max: 21,
        height_min: 17,
        height_max: 21,
        obstacle_density_min: 0.0,
        obstacle_density_max: 1.0,
        wall_components_min: 1,
        wall_components_max: 8,
        go_straight_min: 0.75,
        go_straight_max: 0.85,
    };

    /// Generates the maps in their published order.
    ///
    /// # Errors
    /// None: all settings are in range.
    pub fn maps(self) -> Result<Vec<NamedMap>, Error> {
        self.selected(|_| true)
    }

    /// Generates the maps whose names are selected, in their published order.
    ///
    /// # Errors
    /// None: all settings are in range.
    pub fn selected(self, is_selected: impl Fn(&str) -> bool) -> Result<Vec<NamedMap>, Error> {
        let selected = self.names().filter(|(_, name)| is_selected(name));
        selected.map(|(seed, name)| Ok(NamedMap { name, text: self.generate(seed)? })).collect()
    }

    /// Returns the seed and the name of each map, in their published order.
    pub fn names(self) -> impl Iterator<Item = (u64, String)> {
        let seeds: Range<u64> = match self {
            Self::ValidationRandom | Self::ValidationMazes => SEEDS_OF_VALIDATION,
            Self::TrainingRandom => SEEDS_OF_RANDOM_TRAINING,
            Self::TrainingMazes => SEEDS_OF_MAZE_TRAINING,
            Self::Warehouse => 0..1,
        };
        let all = seeds.clone();
        let name = move |seed| match self {
            Self::Warehouse => "wfi_warehouse".to_owned(),
            _ => seed_name(self.word(), seed, &all),
        };
        seeds.map(move |seed| (seed, name(seed)))
    }

    fn generate(self, seed: u64) -> Result<MapText, Error> {
        match self {
            Self::ValidationRandom | Self::TrainingRandom => {
                RandomRanges::default().sample(seed)?.generate().map(MapText::from)
            }
            Self::ValidationMazes | Self::TrainingMazes => {
                Self::MAZES.sample(seed)?.generate().map(MapText::from)
            }
            Self::Warehouse => Warehouse::PUBLISHED.generate(Bays::Published),
        }
    }
}

/// Returns the name of a seed's map, with the seed padded to the length of the largest seed.
///
/// Source: pogema-toolbox 0.1.1, `random_generator.py`, `generate_and_save_maps`
pub fn seed_name(prefix: &str, seed: u64, seeds: &Range<u64>) -> String {
    let num_digits = seeds.end.saturating_sub(1).to_string().len();
    format!("{prefix}-seed-{seed:0num_digits$}")
}
