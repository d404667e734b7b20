//! Animated GIFs.

use std::collections::BTreeSet;

use gif::{Encoder, Frame, Repeat};
use pogema_core::{Error, Trace};
use tiny_skia::Pixmap;

use crate::motion::Motion;
use crate::numbers;
use crate::scene::Scene;
use crate::style::{Color, Style};

/// Target frame rate. The actual rate of a GIF gives each step a whole number of frames. Units: frames per second.
const RATE: f64 = 20.0;
/// Maximum number of steps per second: browsers slow down frames that are shorter than a fiftieth of a second.
pub const MAX_STEPS_PER_SECOND: f64 = 50.0;
/// The colour index for unchanged pixels, which are transparent.
const UNCHANGED: u8 = u8::MAX;

/// Draws an episode as a GIF that repeats forever.
///
/// `progress` is called after each frame with the number of frames done and the number of all frames.
///
/// Units: `width` in pixels.
///
/// # Errors
/// Those of [`crate::svg::draw`]. Also if the GIF would have more than [`crate::MAX_FRAMES`] frames or
/// [`MAX_STEPS_PER_SECOND`] steps per second, or if a frame would have no pixels, more than
/// [`crate::MAX_FRAME_PIXELS`] pixels, or a side of more than 65,535 pixels.
pub fn encode(
    trace: &Trace,
    style: &Style,
    width: u32,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Vec<u8>, Error> {
    let style = Style { static_frame: None, ..style.clone() };
    let scene = Scene::new(trace, &style)?;
    let shortest = MAX_STEPS_PER_SECOND.recip();
    if style.step_time < shortest {
        let expected = format!("at least {shortest} seconds in a GIF");
        return Err(Error::out_of_range("time of a step", style.step_time, expected));
    }
    let motion = Motion::new(&scene, width, RATE, 1)?;
    let first = motion.frame(0);
    let side = |pixels: u32| {
        let expected = "at most 65535 pixels in a GIF";
        u16::try_from(pixels).map_err(|_| Error::out_of_range("side of the picture", pixels, expected))
    };
    let (width, height) = (side(first.width())?, side(first.height())?);
    let palette = Palette::of(&scene);
    let failed = |error: gif::EncodingError| Error::external("GIF", error);
    let mut encoder = Encoder::new(Vec::new(), width, height, &palette.bytes()).map_err(failed)?;
    encoder.set_repeat(Repeat::Infinite).map_err(failed)?;
    let delay = 100.0 / motion.rate(style.step_time);
    let mut last = palette.indices(&first);
    let mut pending = Frame::from_indexed_pixels(width, height, last.clone(), None);
    for index in 1..=motion.num_frames() {
        let time = delay_at(index, delay);
        if let Some(delay) = pending.delay.checked_add(time) {
            pending.delay = delay;
        } else {
            // The longest delay is 655 seconds. A frame without changes continues the pause.
            let pause = Frame::from_indexed_pixels(1, 1, vec![UNCHANGED], Some(UNCHANGED));
            let pause = Frame { delay: time, ..pause };
            encoder.write_frame(&std::mem::replace(&mut pending, pause)).map_err(failed)?;
        }
        progress(index, motion.num_frames());
        let next =
            if index < motion.num_frames() { palette.indices(&motion.frame(index)) } else { Vec::new() };
        // A frame without changes only lengthens the frame before.
        if next != last {
            let frame = changed(&last, &next, width);
            encoder.write_frame(&std::mem::replace(&mut pending, frame)).map_err(failed)?;
            last = next;
        }
    }
    encoder.into_inner().map_err(|error| Error::external("GIF", error))
}

/// Returns the duration of the frame before frame `index`, rounded so that errors never accumulate. Units: hundredths
/// of a second.
fn delay_at(index: usize, delay: f64) -> u16 {
    let until = |index: usize| (index as f64 * delay).round();
    (until(index) - until(index - 1)) as u16
}

/// Returns the smallest rectangle with all changed pixels; empty if no pixel changed.
fn changed(last: &[u8], next: &[u8], width: u16) -> Frame<'static> {
    let width = usize::from(width);
    let rows = || last.chunks(width).zip(next.chunks(width)).enumerate().filter(|(_, (from, to))| from != to);
    let (top, bottom) = (rows().map(|(row, _)| row).min(), rows().map(|(row, _)| row).max());
    let (Some(top), Some(bottom)) = (top, bottom) else { return Frame::default() };
    let is_changed = |(from, to): (&u8, &u8)| from != to;
    let left =
        rows().filter_map(|(_, (from, to))| from.iter().zip(to).position(is_changed)).min().unwrap_or(0);
    let right =
        rows().filter_map(|(_, (from, to))| from.iter().zip(to).rposition(is_changed)).max().unwrap_or(left);
    let mut buffer = Vec::with_capacity((bottom - top + 1) * (right - left + 1));
    for row in top..=bottom {
        let part = row * width + left..=row * width + right;
        buffer.extend(
            last[part.clone()]
                .iter()
                .zip(&next[part])
                .map(|(from, to)| if from == to { UNCHANGED } else { *to }),
        );
    }
    let (width, height) = ((right - left + 1) as u16, (bottom - top + 1) as u16);
    let part = Frame::from_indexed_pixels(width, height, buffer, Some(UNCHANGED));
    Frame { top: top as u16, left: left as u16, ..part }
}

/// The palette of a scene: even gradients from white to each colour of the scene. With numbers, also even gradients
/// from black to white, and from black to the colours of the agents that have black numbers.
struct Palette {
    colors: Vec<[u8; 3]>,
    /// The index of the nearest colour for each colour with five bits per channel.
    nearest: Vec<u8>,
}

impl Palette {
    /// Bits per channel that [`Palette::indices`] uses.
    const BITS: u32 = 5;

    fn of(scene: &Scene<'_>) -> Self {
        let agents: BTreeSet<Color> = scene.agents().into_iter().map(|agent| scene.color(agent)).collect();
        let to_ink = |&color: &Color| (numbers::ink(color), color);
        let numbered = agents.iter().map(to_ink).chain([(numbers::ink_of_goal(), Color::WHITE)]);
        let numbered = numbered.filter(|_| scene.style.show_numbers);
        let to_white =
            agents.iter().chain([&scene.style.colors.obstacle]).map(|&color| (Color::WHITE, color));
        let gradients: BTreeSet<_> = to_white.chain(numbered).collect();
        let mut colors: Vec<_> =
            gradients.iter().map(|(from, _)| from.0).collect::<BTreeSet<_>>().into_iter().collect();
        let most = usize::from(UNCHANGED) - colors.len();
        let levels = (most / gradients.len()).clamp(1, 24);
        for (from, to) in gradients.into_iter().take(most) {
            let channel = |at: usize, level: usize| {
                let [from, to] = [from, to].map(|color| usize::from(color.0[at]));
                ((from * (levels - level) + to * level) / levels) as u8
            };
            colors.extend((1..=levels).map(|level| [0, 1, 2].map(|at| channel(at, level))));
        }
        let side = 1 << Self::BITS;
        let middle = |at: usize| ((at * 255) / (side - 1)) as u8;
        let all =
            (0..side * side * side).map(|at| [at / (side * side), at / side % side, at % side].map(middle));
        let nearest = all.map(|color| nearest(&colors, color)).collect();
        Self { colors, nearest }
    }

    fn bytes(&self) -> Vec<u8> {
        let mut bytes = self.colors.concat();
        bytes.resize(256 * 3, 0);
        bytes
    }

    /// Returns the colour index of each pixel.
    fn indices(&self, canvas: &Pixmap) -> Vec<u8> {
        let most = (1 << Self::BITS) - 1;
        let part = |value: u8| (usize::from(value) * most + 127) / 255;
        let index = |pixel: &[u8]| {
            let [red, green, blue] = [part(pixel[0]), part(pixel[1]), part(pixel[2])];
            self.nearest[(red << (2 * Self::BITS)) + (green << Self::BITS) + blue]
        };
        canvas.data().chunks_exact(4).map(index).collect()
    }
}

fn nearest(colors: &[[u8; 3]], target: [u8; 3]) -> u8 {
    let distance = |color: &[u8; 3]| {
        color.iter().zip(target).map(|(one, other)| u32::from(one.abs_diff(other)).pow(2)).sum::<u32>()
    };
    let index = (0..colors.len()).min_by_key(|&index| distance(&colors[index]));
    index.unwrap_or_default() as u8
}
