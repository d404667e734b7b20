//! A drawn plot, in one of the formats of pictures.

use std::fmt;

use kuva::backend::{pdf::PdfBackend, png::PngBackend, svg::SvgBackend};
use kuva::render::render::{Primitive, Scene};
use pogema_core::Error;

use super::image_format::ImageFormat;
use super::style::{INCH, Style};

/// A picture of dots may have so many, 4 bytes each.
const MOST_DOTS: f64 = 2e8;

/// A drawn plot.
pub struct Picture {
    /// What is drawn, in points.
    scene: Scene,
    /// Dots in an inch, where it is drawn with dots.
    dots_per_inch: f64,
    /// The format that its view asks for.
    pub kind: ImageFormat,
}

impl Picture {
    /// A scene as a view's options want it.
    pub(super) fn new(mut scene: Scene, style: &Style) -> Self {
        scene.background_color = Some(style.background.clone());
        Self { scene, dots_per_inch: style.dots_per_inch, kind: style.kind }
    }

    /// The file's content.
    ///
    /// # Errors
    /// If it is too large, or the library cannot write it.
    pub fn bytes(&self, kind: ImageFormat) -> Result<Vec<u8>, Error> {
        let told = |reason: String| Error::external("plot", reason);
        match kind {
            ImageFormat::Svg => Ok(SvgBackend::new().render_scene(&self.scene).into_bytes()),
            ImageFormat::Pdf => PdfBackend::new().render_scene(&self.scene).map_err(told),
            ImageFormat::Png => {
                let scale = (self.dots_per_inch / INCH) as f32;
                let dots = self.scene.width * self.scene.height * f64::from(scale).powi(2);
                if dots > MOST_DOTS {
                    return Err(told(format!("`{dots:.0}` dots, expected at most {MOST_DOTS:.0}")));
                }
                PngBackend::new()
                    .with_scale(scale)
                    .render_scene(&with_dashes(&self.scene, scale))
                    .map_err(told)
            }
        }
    }
}

/// The scene as the library draws it with dots: there it leaves out the dashes of lines of more than two points, and
/// does not enlarge those of others.
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
