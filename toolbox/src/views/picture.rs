//! Drawn plots, and their image files.

use std::fmt;

use kuva::backend::{pdf::PdfBackend, png::PngBackend, svg::SvgBackend};
use kuva::render::render::{Primitive, Scene};
use pogema_core::Error;

use super::image_format::ImageFormat;
use super::style::{INCH, Style};

/// Maximum number of pixels of an image, 4 bytes each.
const MOST_PIXELS: f64 = 2e8;

/// A drawn plot.
pub struct Picture {
    /// The drawing. Units: points.
    scene: Scene,
    /// Resolution of formats with pixels.
    dots_per_inch: f64,
    /// The format that its view requests.
    pub kind: ImageFormat,
}

impl Picture {
    /// Creates a picture of a scene with a view's style.
    pub(super) fn new(mut scene: Scene, style: &Style) -> Self {
        scene.background_color = Some(style.background.clone());
        Self { scene, dots_per_inch: style.dots_per_inch, kind: style.kind }
    }

    /// Returns the content of the image file.
    ///
    /// # Errors
    /// If the image is too large, or the library cannot write it.
    pub fn bytes(&self, kind: ImageFormat) -> Result<Vec<u8>, Error> {
        let failed = |reason: String| Error::external("plot", reason);
        match kind {
            ImageFormat::Svg => Ok(SvgBackend::new().render_scene(&self.scene).into_bytes()),
            ImageFormat::Pdf => PdfBackend::new().render_scene(&self.scene).map_err(failed),
            ImageFormat::Png => {
                let scale = (self.dots_per_inch / INCH) as f32;
                let pixels = self.scene.width * self.scene.height * f64::from(scale).powi(2);
                if pixels > MOST_PIXELS {
                    return Err(failed(format!("`{pixels:.0}` pixels, expected at most {MOST_PIXELS:.0}")));
                }
                PngBackend::new()
                    .with_scale(scale)
                    .render_scene(&with_dashes(&self.scene, scale))
                    .map_err(failed)
            }
        }
    }
}

/// Returns a scene whose dashes the library draws in formats with pixels.
///
/// In these formats, the library ignores the dashes of lines of more than two points and does not scale other dashes.
/// So such lines are split into pieces with scaled dashes.
fn with_dashes(scene: &Scene, scale: f32) -> Scene {
    let mut copy = Scene::new(scene.width, scene.height);
    copy.background_color.clone_from(&scene.background_color);
    copy.text_color.clone_from(&scene.text_color);
    copy.font_family.clone_from(&scene.font_family);
    copy.defs.clone_from(&scene.defs);
    copy.elements = scene.elements.iter().flat_map(|element| in_pieces(element, scale)).collect();
    copy
}

fn in_pieces(element: &Primitive, scale: f32) -> Vec<Primitive> {
    let Primitive::PolyLine { points, stroke, stroke_width, stroke_dasharray: Some(dashes) } = element else {
        return vec![element.clone()];
    };
    let lengths = dashes.split(' ').filter_map(|length| length.parse::<f32>().ok());
    let dashes = lengths.map(|length| (length * scale).to_string()).collect::<Vec<_>>().join(" ");
    let pieces = points.iter().zip(points.iter().skip(1)).map(|(&(x1, y1), &(x2, y2))| {
        let (stroke, stroke_width, stroke_dasharray) = (stroke.clone(), *stroke_width, Some(dashes.clone()));
        Primitive::Line { x1, y1, x2, y2, stroke, stroke_width, stroke_dasharray }
    });
    pieces.collect()
}

impl fmt::Debug for Picture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Picture of {} x {} points", self.scene.width, self.scene.height)
    }
}
