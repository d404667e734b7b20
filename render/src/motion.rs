//! The frames of an animation.

use pogema_core::Error;
use tiny_skia::Pixmap;

use crate::raster::Painter;
use crate::scene::Scene;

/// Maximum number of frames of an animation, including those between two states.
pub const MAX_FRAMES: usize = 20_000;
/// Maximum number of pixels of a frame of an animation.
pub const MAX_PIXELS: usize = 1 << 23;

/// A scene cut into evenly spaced frames.
pub(crate) struct Motion<'a> {
    painter: Painter<'a>,
    /// Number of frames per step.
    per_step: usize,
    num_frames: usize,
}

impl<'a> Motion<'a> {
    /// Cuts a scene into about `rate` frames per second. Rounds both sides of a frame up to multiples of `multiple`.
    ///
    /// Units: `width` and `multiple` in pixels.
    ///
    /// # Errors
    /// If the animation would have too many frames, or a frame too many pixels or none.
    pub fn new(scene: &'a Scene<'a>, width: u32, rate: f64, multiple: u32) -> Result<Self, Error> {
        let per_step = (rate * scene.style.step_time).round().max(1.0) as usize;
        // The first and the last state are shown for one more step, as in POGEMA's animations.
        let num_frames = (scene.states.len() + 1).saturating_mul(per_step);
        if num_frames > MAX_FRAMES {
            let expected = format!("at most {MAX_FRAMES}: draw fewer steps or more steps a second");
            return Err(Error::out_of_range("number of frames", num_frames, expected));
        }
        Ok(Self { painter: Painter::new(scene, width, MAX_PIXELS, multiple)?, per_step, num_frames })
    }

    pub fn num_frames(&self) -> usize {
        self.num_frames
    }

    /// Returns the frame rate. Units: frames per second; `step_time` in seconds.
    pub fn rate(&self, step_time: f64) -> f64 {
        self.per_step as f64 / step_time
    }

    /// Returns the width and height. Units: pixels.
    pub fn size(&self) -> [u32; 2] {
        self.painter.size()
    }

    pub fn frame(&self, index: usize) -> Pixmap {
        self.painter.paint(index as f64 / self.per_step as f64 - 1.0)
    }
}
