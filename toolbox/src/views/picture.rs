//! Drawn plots, and their image files.

use std::fmt;
use std::sync::{Arc, LazyLock};

use krilla::Document;
use krilla::geom::Size;
use krilla::page::PageSettings;
use krilla_svg::{SurfaceExt as _, SvgSettings};
use kuva::backend::svg::SvgBackend;
use kuva::render::render::Scene;
use pogema_core::Error;
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{self, fontdb};

use super::image_format::ImageFormat;
use super::style::{INCH, Style};

/// Maximum number of pixels of an image, 4 bytes each.
const MAX_PIXELS: f64 = 2e8;

/// The font of plots, and the fonts of the system for characters that it lacks.
static FONTS: LazyLock<Arc<fontdb::Database>> = LazyLock::new(|| {
    let mut fonts = fontdb::Database::new();
    fonts.load_font_data(dejavu::sans::regular().to_vec());
    fonts.load_system_fonts();
    Arc::new(fonts)
});

/// A drawn plot.
pub struct Picture {
    /// The drawing. Units: points.
    svg: String,
    /// Width and height. Units: points.
    size: (f64, f64),
    /// Resolution of raster formats.
    dots_per_inch: f64,
    /// The format that its view requests.
    pub kind: ImageFormat,
}

impl Picture {
    /// Creates a picture of a scene with a view's style.
    pub(super) fn new(mut scene: Scene, style: &Style) -> Self {
        scene.background_color = Some(style.background.clone());
        let [width, height] = [scene.width, scene.height].map(|length| (length * 100.0).round() / 100.0);
        let svg = in_points(&SvgBackend::new().render_scene(&scene), width, height);
        Self { svg, size: (width, height), dots_per_inch: style.dots_per_inch, kind: style.kind }
    }

    /// Returns the content of the image file. PDF and PNG are made from the SVG, so that all formats look alike.
    ///
    /// # Errors
    /// If the image is too large, or a library cannot write it.
    pub fn bytes(&self, kind: ImageFormat) -> Result<Vec<u8>, Error> {
        match kind {
            ImageFormat::Svg => Ok(self.svg.clone().into_bytes()),
            ImageFormat::Pdf => self.pdf(),
            ImageFormat::Png => self.png(),
        }
    }

    /// Parses the SVG; a unit of the tree is a CSS pixel, 1/96 inch.
    fn tree(&self) -> Result<usvg::Tree, Error> {
        let options = usvg::Options { fontdb: FONTS.clone(), ..usvg::Options::default() };
        usvg::Tree::from_str(&self.svg, &options).map_err(failed)
    }

    fn pdf(&self) -> Result<Vec<u8>, Error> {
        let (width, height) = self.size;
        let size = Size::from_wh(width as f32, height as f32).ok_or_else(|| {
            failed(format!("page size is `{width} x {height}` points, expected sides above 0"))
        })?;
        let mut document = Document::new();
        let mut page = document.start_page_with(PageSettings::new(size));
        let mut surface = page.surface();
        surface.draw_svg(&self.tree()?, size, SvgSettings::default());
        surface.finish();
        page.finish();
        document.finish().map_err(|error| failed(format!("{error:?}")))
    }

    fn png(&self) -> Result<Vec<u8>, Error> {
        let scale = self.dots_per_inch / INCH;
        let [width, height] = [self.size.0, self.size.1].map(|length| (length * scale).round().max(1.0));
        let pixels = width * height;
        if pixels > MAX_PIXELS {
            return Err(failed(format!("`{pixels:.0}` pixels, expected at most {MAX_PIXELS:.0}")));
        }
        let (width, height) = (width as u32, height as u32);
        let mut pixmap = Pixmap::new(width, height).ok_or_else(|| failed("no memory for the pixels"))?;
        let tree = self.tree()?;
        let scales = (width as f32 / tree.size().width(), height as f32 / tree.size().height());
        resvg::render(&tree, Transform::from_scale(scales.0, scales.1), &mut pixmap.as_mut());
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(png::ColorType::Rgba);
        // The resolution lets a document show the picture at its size in points.
        let per_metre = (self.dots_per_inch / 0.0254).round() as u32;
        encoder.set_pixel_dims(Some(png::PixelDimensions {
            xppu: per_metre,
            yppu: per_metre,
            unit: png::Unit::Meter,
        }));
        let write = |encoder: png::Encoder<'_, _>| {
            let mut writer = encoder.write_header()?;
            // The background is opaque, so all pixels are opaque, and their premultiplied colours equal the plain ones.
            writer.write_image_data(pixmap.data())?;
            writer.finish()
        };
        write(encoder).map_err(failed)?;
        Ok(bytes)
    }
}

fn failed(reason: impl fmt::Display) -> Error {
    Error::external("plot", reason.to_string())
}

/// Returns an SVG whose size is in points. The library writes CSS pixels, which are three quarters of a point.
fn in_points(svg: &str, width: f64, height: f64) -> String {
    let Some((_, rest)) = svg.split_once(" font-family=") else { return svg.to_owned() };
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}pt\" height=\"{height}pt\" \
         viewBox=\"0 0 {width} {height}\" font-family={rest}"
    )
}

impl fmt::Debug for Picture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Picture of {} x {} points", self.size.0, self.size.1)
    }
}
