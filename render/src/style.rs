//! The appearance of drawn episodes.

use std::fmt;
use std::str::FromStr;

use pogema_core::{Error, shorten};

use crate::ground::Border;

/// A colour as red, green and blue.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Color(pub [u8; 3]);

impl Color {
    /// The background of raster pictures.
    pub const WHITE: Self = Self([255; 3]);

    /// Returns the colour of a number such as `0xc1433c`.
    fn of_rgb(number: u32) -> Self {
        let [_, rgb @ ..] = number.to_be_bytes();
        Self(rgb)
    }
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
        number.filter(|_| !text.contains('+')).map(Self::of_rgb).ok_or_else(|| {
            let found = shorten(text, Error::LONGEST_QUOTE);
            Error::request(format!("colour is `{found}`, expected a colour such as `#c1433c`"))
        })
    }
}

/// The colours of a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Colors {
    /// Obstacles and lines.
    pub obstacle: Color,
    /// Agents and goals, by agent index; the list repeats.
    pub agents: Vec<Color>,
    /// The viewing agent of an egocentric picture, its goal and its window.
    pub own: Color,
    /// All other agents of an egocentric picture.
    pub others: Color,
}

/// The colours of agents: POGEMA's seven, then colours that were chosen to be far from those before them.
#[allow(clippy::unreadable_literal, reason = "a colour is read as three pairs of digits")]
const AGENTS: [u32; 24] = [
    0xc1433c, 0x2e6f9e, 0x6e81af, 0x00b9c8, 0x72d5c8, 0x0ea08c, 0x8f7b66, 0xfca800, 0xfc90f0, 0x903090,
    0x007800, 0x90b40c, 0xfc7878, 0xcc60b4, 0xa890fc, 0x249cfc, 0x845400, 0xcc8418, 0x6c9024, 0x6c54c0,
    0xe4a8b4, 0x90c0fc, 0x00cc84, 0x84546c,
];

/// POGEMA's colours, and more for agents.
///
/// Source: POGEMA 1.4.0, `svg_animation/animation_drawer.py`, `SvgSettings`
impl Default for Colors {
    #[allow(clippy::unreadable_literal, reason = "a colour is read as three pairs of digits")]
    fn default() -> Self {
        Self {
            obstacle: Color::of_rgb(0x84a1ae),
            agents: AGENTS.map(Color::of_rgb).to_vec(),
            own: Color::of_rgb(0xc1433c),
            others: Color::of_rgb(0x6e81af),
        }
    }
}

/// The appearance of an episode in SVG, PNG, GIF and video.
#[derive(Clone, Debug, PartialEq)]
pub struct Style {
    /// Draw only this frame, without animation; 0 is the state after the reset.
    pub static_frame: Option<usize>,
    /// Draw the view of this agent; shade the agents it does not see and the obstacles it has not seen.
    pub egocentric: Option<usize>,
    /// Whether agents and goals are drawn.
    pub show_agents: bool,
    /// Whether the index of each agent is written into the agent and its goal.
    pub show_numbers: bool,
    /// Whether lines are drawn between the cells.
    pub show_lines: bool,
    /// The part of the border that is drawn.
    pub border: Border,
    /// Duration of a step. Units: seconds.
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
            show_numbers: false,
            show_lines: true,
            border: Border::default(),
            step_time: 0.25,
            colors: Colors::default(),
        }
    }
}
