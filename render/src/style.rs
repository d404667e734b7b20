//! How an episode is drawn.

use std::fmt;
use std::str::FromStr;

use pogema_core::{Error, shorten};

use crate::ground::Border;

/// A colour as red, green and blue.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Color(pub [u8; 3]);

impl Color {
    /// What raster pictures are drawn on.
    pub const WHITE: Self = Self([255; 3]);
}

impl fmt::Display for Color {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [red, green, blue] = self.0;
        write!(f, "#{red:02x}{green:02x}{blue:02x}")
    }
}

impl FromStr for Color {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6 && digits.is_ascii());
        let number = digits.and_then(|digits| u32::from_str_radix(digits, 16).ok());
        let [_, rgb @ ..] =
            number.filter(|_| !text.contains('+')).map(u32::to_be_bytes).ok_or_else(|| {
                let found = shorten(text, Error::LONGEST_QUOTE);
                Error::request(format!("colour is `{found}`, expected one such as `#c1433c`"))
            })?;
        Ok(Self(rgb))
    }
}

/// The colours of a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Colors {
    /// Obstacles and lines.
    pub obstacle: Color,
    /// The agents by index, in turn.
    pub agents: Vec<Color>,
    /// In an agent's view, that agent, its goal and its window.
    pub own: Color,
    /// In an agent's view, all other agents.
    pub others: Color,
}

/// POGEMA's colours.
///
/// Source: POGEMA 1.4.0, `svg_animation/animation_drawer.py`, `SvgSettings`
impl Default for Colors {
    fn default() -> Self {
        Self {
            obstacle: Color([0x84, 0xa1, 0xae]),
            agents: vec![
                Color([0xc1, 0x43, 0x3c]),
                Color([0x2e, 0x6f, 0x9e]),
                Color([0x6e, 0x81, 0xaf]),
                Color([0x00, 0xb9, 0xc8]),
                Color([0x72, 0xd5, 0xc8]),
                Color([0x0e, 0xa0, 0x8c]),
                Color([0x8f, 0x7b, 0x66]),
            ],
            own: Color([0xc1, 0x43, 0x3c]),
            others: Color([0x6e, 0x81, 0xaf]),
        }
    }
}

/// How an episode is drawn, in SVG, PNG, GIF and video alike.
#[derive(Clone, Debug, PartialEq)]
pub struct Style {
    /// Draw this frame alone, standing still; 0 is the state after the reset.
    pub static_frame: Option<usize>,
    /// Draw what this agent sees and has seen; all else is shaded.
    pub egocentric: Option<usize>,
    /// Whether agents and goals are drawn.
    pub show_agents: bool,
    /// Whether lines are drawn between the cells.
    pub show_lines: bool,
    /// How much of the border is drawn.
    pub border: Border,
    /// How long a step takes. Units: seconds.
    pub step_time: f64,
    /// The colours.
    pub colors: Colors,
}

impl Default for Style {
    fn default() -> Self {
        Self {
            static_frame: None,
            egocentric: None,
            show_agents: true,
            show_lines: true,
            border: Border::default(),
            step_time: 0.25,
            colors: Colors::default(),
        }
    }
}
