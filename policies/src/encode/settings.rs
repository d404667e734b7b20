//! The settings of an encoder.

use pogema_core::{Config, Error};
use serde::{Deserialize, Serialize};

use crate::encode::words::{Channel, Scalars};
use crate::follower::FollowerVersion;

/// Maximum number of channels, and of scalars.
const MAX_ENTRIES: usize = 64;

/// The settings of an encoder: the windows and scalars that a policy observes for each agent.
///
/// ```
/// use pogema_policies::{Channel, EncoderSettings};
///
/// let settings: EncoderSettings = serde_json::from_str(r#"{"radius": 3, "channels": ["obstacles", "cost_to_go"]}"#)?;
/// assert_eq!(settings.channels[1], Channel::CostToGo);
/// assert_eq!(settings.shape(), [2, 7, 7]);
/// # Ok::<(), serde_json::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EncoderSettings {
    /// Number of cells that a window shows in each direction, 1 to 128.
    pub radius: usize,
    /// The windows of each agent, in this order.
    pub channels: Vec<Channel>,
    /// The scalars of each agent, in this order.
    #[serde(default)]
    pub scalars: Vec<Scalars>,
    /// Number of cells that an agent sees in each direction, 1 to 128, for `seen_agents`, `seen_obstacles` and
    /// `follower_path`.
    #[serde(default = "EncoderSettings::default_sight")]
    pub sight: usize,
    /// The version of Follower whose path `follower_path` shows.
    #[serde(default)]
    pub follower: FollowerVersion,
}

impl EncoderSettings {
    fn default_sight() -> usize {
        Config::default().radius
    }

    /// Creates settings with these windows, no scalars, and POGEMA's default radius as sight.
    pub fn new(radius: usize, channels: impl Into<Vec<Channel>>) -> Self {
        Self {
            radius,
            channels: channels.into(),
            scalars: Vec::new(),
            sight: Self::default_sight(),
            follower: FollowerVersion::default(),
        }
    }

    /// Creates the settings of Follower: its path and the agents. The authors' networks have radius 5 (Follower) and 3
    /// (Follower-lite).
    pub fn follower(radius: usize, version: FollowerVersion) -> Self {
        Self { follower: version, ..Self::new(radius, [Channel::FollowerPath, Channel::Agents]) }
    }

    /// Returns whether the windows include at least one of these channels.
    pub(crate) fn has(&self, channels: &[Channel]) -> bool {
        self.channels.iter().any(|known| channels.contains(known))
    }

    /// Returns the side of a window. Units: cells.
    pub fn side(&self) -> usize {
        2 * self.radius + 1
    }

    /// Returns the shape of the windows of one agent: `[channels, side, side]`.
    pub fn shape(&self) -> [usize; 3] {
        [self.channels.len(), self.side(), self.side()]
    }

    /// Returns the number of values in the windows of one agent.
    pub fn window_len(&self) -> usize {
        self.shape().iter().product()
    }

    /// Returns the number of scalar values of one agent.
    pub fn scalars_len(&self) -> usize {
        self.scalars.len() * Scalars::LEN
    }

    /// Checks the radii and the numbers of windows and scalars.
    ///
    /// # Errors
    /// [`Error::Config`] naming the first field that is out of range.
    pub fn check(&self) -> Result<(), Error> {
        for (field, value) in [("radius", self.radius), ("sight", self.sight)] {
            if !(1..=Config::LARGEST_RADIUS).contains(&value) {
                return Err(Error::config(field, value, format!("1 to {}", Config::LARGEST_RADIUS)));
            }
        }
        for (field, len) in [("channels", self.channels.len()), ("scalars", self.scalars.len())] {
            if len > MAX_ENTRIES {
                return Err(Error::config(
                    field,
                    format!("a list of {len}"),
                    format!("at most {MAX_ENTRIES}"),
                ));
            }
        }
        Ok(())
    }
}
