//! The index of an agent, written into the agent and its goal.

use std::sync::LazyLock;

use tiny_skia::{Path, PathBuilder, Transform};
use ttf_parser::{Face, OutlineBuilder};

use crate::style::Color;

/// The font of numbers.
pub const FONT: &str = "DejaVu Sans, Verdana, Arial, sans-serif";

/// Height of a digit, relative to the font size.
const DIGIT: f64 = 0.73;

/// Returns the font size for the numbers of this many agents. Units: cells.
pub fn font_size(num_agents: usize) -> f64 {
    let digits = num_agents.saturating_sub(1).checked_ilog10().map_or(1, |tens| tens + 1);
    if digits < 3 { 0.4 } else { 0.9 / f64::from(digits) }
}

/// Returns the distance of the baseline below the centre of a cell. Units: cells.
pub fn baseline(font_size: f64) -> f64 {
    font_size * DIGIT / 2.0
}

/// Returns black or white, whichever is easier to read on a colour.
pub fn ink(color: Color) -> Color {
    let [red, green, blue] = color.0.map(f64::from);
    // Weights of the luma in BT.601.
    let luma = 0.299 * red + 0.587 * green + 0.114 * blue;
    Color([if luma > 150.0 { 0 } else { u8::MAX }; 3])
}

/// The colour of a number in a goal, whose inside is white: many colours of agents would be too pale there.
pub fn ink_of_goal() -> Color {
    ink(Color::WHITE)
}

/// Returns the outline of a number whose digits are centred at a position. Units: cells.
pub fn outline(number: usize, [col, row]: [f32; 2], font_size: f64) -> Option<Path> {
    static FACE: LazyLock<Option<Face<'static>>> =
        LazyLock::new(|| Face::parse(dejavu::sans::regular(), 0).ok());
    let face = FACE.as_ref()?;
    let mut outline = Outline { path: PathBuilder::new(), left: 0.0 };
    for digit in number.to_string().chars() {
        let glyph = face.glyph_index(digit)?;
        face.outline_glyph(glyph, &mut outline);
        outline.left += f32::from(face.glyph_hor_advance(glyph)?);
    }
    let (width, scale) = (outline.left, font_size as f32 / f32::from(face.units_per_em()));
    let left = col - width * scale / 2.0;
    let place = Transform::from_row(scale, 0.0, 0.0, -scale, left, row + baseline(font_size) as f32);
    outline.path.finish()?.transform(place)
}

/// Collects the glyphs of a number side by side. Units: those of the font.
struct Outline {
    path: PathBuilder,
    /// The left end of the next glyph.
    left: f32,
}

impl OutlineBuilder for Outline {
    fn move_to(&mut self, x: f32, y: f32) {
        self.path.move_to(self.left + x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.path.line_to(self.left + x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.path.quad_to(self.left + x1, y1, self.left + x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.path.cubic_to(self.left + x1, y1, self.left + x2, y2, self.left + x, y);
    }

    fn close(&mut self) {
        self.path.close();
    }
}
