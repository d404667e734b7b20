//! Generator of maps with random obstacles.

use pogema_core::{Error, Map};

use super::{check_sides, draw_between, draw_share};
use pogema_numpy::Generator;

/// The ranges from which the settings of a random map are drawn.
///
/// Source: pogema-toolbox 0.1.1, `random_generator.py`, `MapRangeSettings`
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(missing_docs, reason = "each is the setting of its name")]
pub struct RandomRanges {
    pub width_min: i64,
    pub width_max: i64,
    pub height_min: i64,
    pub height_max: i64,
    pub obstacle_density_min: f64,
    pub obstacle_density_max: f64,
}

impl Default for RandomRanges {
    fn default() -> Self {
        Self {
            width_min: 17,
            width_max: 21,
            height_min: 17,
            height_max: 21,
            obstacle_density_min: 0.1,
            obstacle_density_max: 0.3,
        }
    }
}

impl RandomRanges {
    /// Draws the settings of a random map from a seed.
    ///
    /// # Errors
    /// [`Error::Argument`] for an empty range, or for a limit that is too large or not finite.
    ///
    /// Source: pogema-toolbox 0.1.1, `random_generator.py`, `MapRangeSettings.sample`
    pub fn sample(&self, seed: u64) -> Result<RandomMap, Error> {
        let mut generator = Generator::seeded(seed);
        Ok(RandomMap {
            width: draw_between(&mut generator, "width", (self.width_min, self.width_max))?,
            height: draw_between(&mut generator, "height", (self.height_min, self.height_max))?,
            obstacle_density: draw_share(
                &mut generator,
                "obstacle_density",
                (self.obstacle_density_min, self.obstacle_density_max),
            )?,
            seed,
        })
    }
}

/// The settings of one random map.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(missing_docs, reason = "each is the setting of its name")]
pub struct RandomMap {
    pub width: i64,
    pub height: i64,
    pub obstacle_density: f64,
    pub seed: u64,
}

impl RandomMap {
    /// Generates the map.
    ///
    /// # Errors
    /// [`Error::Argument`] for a side or density out of range.
    ///
    /// Source: pogema-toolbox 0.1.1, `random_generator.py`, `generate_map`
    pub fn generate(&self) -> Result<Map, Error> {
        check_sides(self.width, self.height)?;
        if !(0.0..=1.0).contains(&self.obstacle_density) {
            return Err(Error::argument("obstacle_density", self.obstacle_density, "a number from 0 to 1"));
        }
        let (width, height) = (self.width as usize, self.height as usize);
        let num_obstacles = ((width * height) as f64 * self.obstacle_density) as usize;
        let mut obstacles = vec![false; width * height];
        let mut generator = Generator::seeded(self.seed);
        let mut num_placed = 0;
        while num_placed < num_obstacles {
            // INVARIANT: neither range is empty.
            let col = generator.integers(0, self.width).unwrap_or_default() as usize;
            let row = generator.integers(0, self.height).unwrap_or_default() as usize;
            num_placed += usize::from(!std::mem::replace(&mut obstacles[row * width + col], true));
        }
        Map::new(height, width, obstacles)
    }
}
