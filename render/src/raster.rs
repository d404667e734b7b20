//! PNG pictures, and the frames of animations.

use pogema_core::{Error, Trace};
use tiny_skia::{FillRule, LineCap, Paint, Path, PathBuilder, Pixmap, Rect, Stroke, StrokeDash, Transform};

use crate::ground::Ground;
use crate::numbers;
use crate::scene::{LINE_OPACITY, Look, Obstacles, SHADED, Scene, size};
use crate::style::{Color, Style};

/// Maximum number of pixels of a picture. A pixel takes four bytes.
pub const MAX_PIXELS: usize = 1 << 26;

/// The longer side of a PNG by default. Units: pixels.
pub const LONGER_SIDE: u32 = 1024;

/// Draws the style's static frame as PNG on a white background [default: frame 0].
///
/// Units: `width` in pixels.
///
/// # Errors
/// Those of [`crate::svg::draw`], and if the picture would have no pixels or more than [`MAX_PIXELS`].
pub fn png(trace: &Trace, style: &Style, width: u32) -> Result<Vec<u8>, Error> {
    let style = Style { static_frame: style.static_frame.or(Some(0)), ..style.clone() };
    let scene = Scene::new(trace, &style)?;
    let canvas = Painter::new(&scene, width, MAX_PIXELS, 1)?.paint(0.0);
    canvas.encode_png().map_err(|error| Error::external("PNG", error))
}

/// Returns the width of a picture whose longer side is about `longer`.
///
/// If cells are at least one pixel wide, their width is a whole number of pixels, so that all cells look the same.
///
/// Units: pixels.
pub fn width_for(trace: &Trace, style: &Style, longer: u32) -> u32 {
    let ground = Ground::of(trace);
    let (height, width) = (ground.rows(style.border).len() + 1, ground.cols(style.border).len() + 1);
    let cell = f64::from(longer) / height.max(width) as f64;
    let cell = if cell >= 1.0 { cell.floor() } else { cell };
    ((width as f64 * cell).ceil() as u32).min(longer.max(1))
}

/// Draws the frames of a scene and intermediate frames; draws unchanging parts only once.
pub(crate) struct Painter<'a> {
    scene: &'a Scene<'a>,
    transform: Transform,
    background: Pixmap,
    /// The obstacles that the viewing agent first sees after the first frame: the frame and the shape.
    fading: Vec<(usize, Path)>,
    agents: Vec<usize>,
    goals: Vec<usize>,
}

impl<'a> Painter<'a> {
    /// Returns a painter for pictures of at most `most` pixels; rounds both sides up to multiples of `multiple`.
    pub fn new(scene: &'a Scene<'a>, width: u32, most: usize, multiple: u32) -> Result<Self, Error> {
        let [left, top, cols, rows] = scene.view_box();
        let scale = f64::from(width) / f64::from(cols);
        let whole = |side: f64| (side.ceil() as usize).next_multiple_of(multiple as usize);
        let (width, height) = (whole(width.into()), whole(f64::from(rows) * scale));
        if width == 0 || width.saturating_mul(height) > most {
            let value = format!("{width} x {height} pixels");
            return Err(Error::out_of_range(
                "size of the picture",
                value,
                format!("1 to {most} pixels in all: choose another width"),
            ));
        }
        let failed = || Error::external("picture", format!("no memory for {width} x {height} pixels"));
        let background = Pixmap::new(width as u32, height as u32).ok_or_else(failed)?;
        let transform =
            Transform::from_scale(scale as f32, scale as f32).pre_translate(-left as f32, -top as f32);
        let mut painter = Self {
            scene,
            transform,
            background,
            fading: Vec::new(),
            agents: scene.agents(),
            goals: scene.goals(),
        };
        painter.paint_background();
        Ok(painter)
    }

    /// Returns the width and height. Units: pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.background.width(), self.background.height()]
    }

    /// Draws the picture at a given time. Units: frames.
    pub fn paint(&self, time: f64) -> Pixmap {
        let mut canvas = self.background.clone();
        let obstacle = self.scene.style.colors.obstacle;
        for (seen, shape) in &self.fading {
            let strength = (time - (*seen as f64 - 1.0)).clamp(0.0, 1.0);
            fill(&mut canvas, shape, obstacle, SHADED + strength * (1.0 - SHADED), self.transform);
        }
        let circle = |agent: usize, look: fn(&Scene<'a>, usize, usize) -> Look| {
            let ([col, row], opacity) = self.place(agent, look, time)?;
            Some((PathBuilder::from_circle(col, row, size::AGENT as f32)?, self.scene.color(agent), opacity))
        };
        for &agent in &self.goals {
            if let Some((path, color, opacity)) = circle(agent, Scene::goal) {
                stroke(&mut canvas, &path, color, opacity, None, self.transform);
                let place = self.place(agent, Scene::goal, time);
                self.paint_number(&mut canvas, agent, place, numbers::ink_of_goal());
            }
        }
        for &agent in &self.agents {
            if let Some((path, color, opacity)) = circle(agent, Scene::agent) {
                fill(&mut canvas, &path, color, opacity, self.transform);
                self.paint_number(
                    &mut canvas,
                    agent,
                    self.place(agent, Scene::agent, time),
                    numbers::ink(color),
                );
            }
        }
        self.paint_window(&mut canvas, time);
        canvas
    }

    /// If the style shows numbers, writes the index of an agent.
    fn paint_number(&self, canvas: &mut Pixmap, agent: usize, place: Option<([f32; 2], f64)>, color: Color) {
        let Some((place, opacity)) = place.filter(|_| self.scene.style.show_numbers) else { return };
        let font_size = numbers::font_size(self.scene.num_agents());
        if let Some(path) = numbers::outline(agent, place, font_size) {
            fill(canvas, &path, color, opacity, self.transform);
        }
    }

    /// Draws the white background, the lines and the obstacles that never change.
    fn paint_background(&mut self) {
        let [red, green, blue] = Color::WHITE.0;
        self.background.fill(tiny_skia::Color::from_rgba8(red, green, blue, u8::MAX));
        let (scene, transform) = (self.scene, self.transform);
        let color = scene.style.colors.obstacle;
        if scene.style.show_lines
            && let Some(path) = lines(scene)
        {
            stroke(&mut self.background, &path, color, LINE_OPACITY, None, transform);
        }
        for Obstacles { seen, cells } in scene.obstacles() {
            for shape in cells.iter().filter_map(|&(row, col)| obstacle(row, col)) {
                match seen {
                    Some(frame) if frame > 0 => self.fading.push((frame, shape)),
                    Some(_) => fill(&mut self.background, &shape, color, 1.0, transform),
                    None => fill(&mut self.background, &shape, color, SHADED, transform),
                }
            }
        }
    }

    fn paint_window(&self, canvas: &mut Pixmap, time: f64) {
        let place = self.scene.window().and_then(|agent| self.place(agent, Scene::agent, time));
        let Some(([col, row], _)) = place else { return };
        let reach = self.scene.trace.header.config.radius as f32 + size::WINDOW as f32;
        let corner = size::CORNER as f32;
        let dash = StrokeDash::new(vec![size::DASH as f32; 2], 0.0);
        if let Some(path) = rounded_square(col - reach, row - reach, 2.0 * reach, corner) {
            stroke(canvas, &path, self.scene.style.colors.own, 1.0, dash, self.transform);
        }
    }

    /// Returns the (col, row) and the opacity of an agent or goal at a given time; `None` if it is hidden.
    fn place(
        &self,
        agent: usize,
        look: fn(&Scene<'a>, usize, usize) -> Look,
        time: f64,
    ) -> Option<([f32; 2], f64)> {
        let last = self.scene.states.len() - 1;
        let frame = (time.max(0.0) as usize).min(last);
        let (from, to) = (look(self.scene, agent, frame), look(self.scene, agent, (frame + 1).min(last)));
        let share = (time - frame as f64).clamp(0.0, 1.0);
        let between = |from: f64, to: f64| from + share * (to - from);
        let col = between(from.cell.col.into(), to.cell.col.into()) as f32;
        let row = between(from.cell.row.into(), to.cell.row.into()) as f32;
        from.is_visible.then(|| ([col, row], between(from.opacity, to.opacity)))
    }
}

/// Returns the lines between and around the cells, half a cell longer at both ends.
fn lines(scene: &Scene<'_>) -> Option<Path> {
    let [left, top, width, height] = scene.view_box();
    let mut path = PathBuilder::new();
    let (left, top, right, bottom) = (left as f32, top as f32, (left + width) as f32, (top + height) as f32);
    for col in 0..width {
        path.move_to(left + col as f32 + 0.5, top);
        path.line_to(left + col as f32 + 0.5, bottom);
    }
    for row in 0..height {
        path.move_to(left, top + row as f32 + 0.5);
        path.line_to(right, top + row as f32 + 0.5);
    }
    path.finish()
}

fn obstacle(row: i32, col: i32) -> Option<Path> {
    let half = size::OBSTACLE as f32 / 2.0;
    rounded_square(col as f32 - half, row as f32 - half, 2.0 * half, size::CORNER as f32)
}

/// Returns a square with round corners. The path starts at the left of the upper edge and goes clockwise, as in SVG.
fn rounded_square(left: f32, top: f32, side: f32, corner: f32) -> Option<Path> {
    /// Length of the handles of a Bézier curve that approximates a quarter of the unit circle.
    const HANDLE: f32 = 0.552_285;
    let square = Rect::from_xywh(left, top, side, side)?;
    let (right, bottom) = (square.right(), square.bottom());
    let near = corner * (1.0 - HANDLE);
    let mut path = PathBuilder::new();
    path.move_to(left + corner, top);
    path.line_to(right - corner, top);
    path.cubic_to(right - near, top, right, top + near, right, top + corner);
    path.line_to(right, bottom - corner);
    path.cubic_to(right, bottom - near, right - near, bottom, right - corner, bottom);
    path.line_to(left + corner, bottom);
    path.cubic_to(left + near, bottom, left, bottom - near, left, bottom - corner);
    path.line_to(left, top + corner);
    path.cubic_to(left, top + near, left + near, top, left + corner, top);
    path.close();
    path.finish()
}

fn fill(canvas: &mut Pixmap, path: &Path, color: Color, opacity: f64, transform: Transform) {
    canvas.fill_path(path, &paint(color, opacity), FillRule::Winding, transform, None);
}

fn stroke(
    canvas: &mut Pixmap,
    path: &Path,
    color: Color,
    opacity: f64,
    dash: Option<StrokeDash>,
    transform: Transform,
) {
    let stroke = Stroke { width: size::STROKE as f32, line_cap: LineCap::Butt, dash, ..Stroke::default() };
    canvas.stroke_path(path, &paint(color, opacity), &stroke, transform, None);
}

fn paint(color: Color, opacity: f64) -> Paint<'static> {
    let [red, green, blue] = color.0;
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    paint.set_color_rgba8(red, green, blue, (opacity * 255.0).round() as u8);
    paint
}
