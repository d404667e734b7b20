//! The style of plots.

use pogema_core::Error;
use serde_json::Value;

use super::axes::{Axis, Frame};
use super::image_format::ImageFormat;
use super::options::Options;

/// Number of points per inch; pictures are measured in points.
pub(super) const INCH: f64 = 72.0;

/// Default width and height of a plot. The width is that of a column in a two-column paper. Units: inches.
pub(super) const COLUMN: (f64, f64) = (3.4, 2.6);

/// Colours that are safe for most forms of colour blindness, and visible on white even in greyscale.
///
/// Source: the first seven from Okabe and Ito (2008), "Color Universal Design", without their yellow; most of the
/// others from Tol (2021), "Colour Schemes"
const COLOURS: [&str; 12] = [
    "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#882255", "#332288",
    "#999933", "#661100", "#7F7F7F",
];

/// The options of every plot.
///
/// Source: pogema-toolbox 0.1.1, `view_plot.py`, `PlotView`
const KEYS: &str = "name width height remove_title line_width error_bar plt_style figure_dpi font_size \
    legend_font_size legend_loc legend_columns legend_bbox_to_anchor figure_face_color use_log_scale_x \
    use_log_scale_y markers line_types extension palette hue_order tight_layout ticks remove_legend_title x y by";

/// The places of a legend.
///
/// Source: Matplotlib, `legend`, parameter `loc`
const PLACES: &str = "best, upper right, upper left, lower left, lower right, right, center left, center right, \
    lower center, upper center, center";

/// The style of one plot. Units: points.
#[derive(Clone, Debug)]
#[allow(clippy::struct_excessive_bools, reason = "independent options of a file")]
pub(super) struct Style {
    pub name: Option<String>,
    pub has_title: bool,
    pub width: f64,
    pub height: f64,
    pub line_width: f64,
    pub font_size: u32,
    pub legend_font_size: u32,
    pub legend_place: Option<&'static str>,
    pub legend_columns: usize,
    pub has_legend_title: bool,
    pub background: String,
    pub log_x: bool,
    pub log_y: bool,
    pub has_markers: bool,
    pub has_line_types: bool,
    pub ticks: Option<Vec<f64>>,
    pub order: Option<Vec<String>>,
    pub kind: ImageFormat,
    pub dots_per_inch: f64,
    pub palette: Vec<String>,
}

impl Style {
    /// Returns the keys of all plots, and further keys of one type.
    pub fn keys(more: &[&'static str]) -> Vec<&'static str> {
        KEYS.split(' ').chain(more.iter().copied()).collect()
    }

    /// Reads the options of a plot; the given size in inches is the default.
    pub fn read(options: &Options<'_>, (width, height): (f64, f64)) -> Result<Self, Error> {
        // These options are checked but have no effect: they concern Matplotlib, or are fixed here.
        options.text("plt_style")?;
        options.flag("tight_layout")?;
        options.numbers("legend_bbox_to_anchor")?;
        let size = |key, default| Ok::<f64, Error>(options.size(key)?.unwrap_or(default));
        let flag = |key, default| Ok::<bool, Error>(options.flag(key)?.unwrap_or(default));
        Ok(Self {
            name: options.text("name")?,
            has_title: !flag("remove_title", false)?,
            width: size("width", width)?.clamp(0.5, 100.0) * INCH,
            height: size("height", height)?.clamp(0.5, 100.0) * INCH,
            line_width: size("line_width", 1.5)?,
            font_size: size("font_size", 8.0)?.round().clamp(1.0, 100.0) as u32,
            legend_font_size: size("legend_font_size", 7.0)?.round().clamp(1.0, 100.0) as u32,
            legend_place: options.choice("legend_loc", &PLACES.split(", ").collect::<Vec<_>>())?,
            legend_columns: options.whole("legend_columns", 100)?.unwrap_or(5).max(1),
            has_legend_title: !flag("remove_legend_title", true)?,
            background: colour_option(options, "figure_face_color")?.unwrap_or_else(|| "#FFFFFF".to_owned()),
            log_x: flag("use_log_scale_x", false)?,
            log_y: flag("use_log_scale_y", false)?,
            has_markers: flag("markers", true)?,
            has_line_types: flag("line_types", true)?,
            ticks: options.numbers("ticks")?.filter(|ticks| !ticks.is_empty()),
            order: options.words("hue_order")?,
            kind: options.word("extension")?.unwrap_or_default(),
            dots_per_inch: size("figure_dpi", 300.0)?.clamp(10.0, 2400.0),
            palette: palette(options)?,
        })
    }

    /// Returns the colour of the line with the given index.
    pub fn colour(&self, number: usize) -> &str {
        &self.palette[number % self.palette.len()]
    }

    /// Returns the title, if it is shown.
    pub fn title(&self) -> Option<&str> {
        self.name.as_deref().filter(|_| self.has_title)
    }

    /// Returns the frame of a plot with a single panel.
    pub fn frame(&self, x: Axis, y: Axis) -> Frame {
        let Self { width, height, font_size, .. } = *self;
        Frame { width, height, font_size, title: self.title().map(str::to_owned), is_square: false, x, y }
    }
}

fn palette(options: &Options<'_>) -> Result<Vec<String>, Error> {
    let Some(values) = options.values("palette")?.filter(|values| !values.is_empty()) else {
        return Ok(COLOURS.map(str::to_owned).to_vec());
    };
    let colours: Option<Vec<String>> = values.iter().map(colour).collect();
    colours.ok_or_else(|| options.reject("palette", "colours such as `#0072B2` or [0.0, 0.45, 0.7]"))
}

fn colour_option(options: &Options<'_>, key: &str) -> Result<Option<String>, Error> {
    let Some(text) = options.text(key)? else { return Ok(None) };
    colour(&text.into()).map(Some).ok_or_else(|| options.reject(key, "a colour such as `#0072B2`"))
}

/// Reads a colour given as in CSS or as three shares from 0 to 1, and returns it as `#RRGGBB`.
fn colour(value: &Value) -> Option<String> {
    let [red, green, blue] = match value {
        Value::String(text) => {
            let found: svgtypes::Color =
                text.parse().ok().filter(|found: &svgtypes::Color| found.alpha == 255)?;
            [found.red, found.green, found.blue]
        }
        Value::Array(shares) => {
            let shares: Option<Vec<f64>> = shares.iter().map(Value::as_f64).collect();
            let byte = |share: f64| (share.clamp(0.0, 1.0) * 255.0).round() as u8;
            <[f64; 3]>::try_from(shares?).ok()?.map(byte)
        }
        _ => return None,
    };
    Some(format!("#{red:02X}{green:02X}{blue:02X}"))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    /// Returns the relative luminance of a colour, from 0 (black) to 1 (white).
    ///
    /// Source: W3C, WCAG 2.2, "relative luminance"
    fn luminance(colour: &str) -> f64 {
        let share = |place| {
            let byte = u8::from_str_radix(&colour[place..place + 2], 16).unwrap();
            let share = f64::from(byte) / 255.0;
            if share <= 0.04045 { share / 12.92 } else { ((share + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * share(1) + 0.7152 * share(3) + 0.0722 * share(5)
    }

    #[test]
    fn every_colour_is_visible_on_white() {
        for colour in COLOURS {
            let contrast = 1.05 / (luminance(colour) + 0.05);
            assert!(contrast >= 2.0, "{colour}: {contrast:.2}");
        }
    }

    #[test]
    fn valid_colours_are_read_and_invalid_ones_are_rejected() {
        for (value, expected) in [
            (json!("#0072b2"), "#0072B2"),
            (json!("#07b"), "#0077BB"),
            (json!("teal"), "#008080"),
            (json!("rgb(1, 2, 3)"), "#010203"),
            (json!([0.0, 0.5, 2]), "#0080FF"),
        ] {
            assert_eq!(colour(&value).as_deref(), Some(expected));
        }
        for value in
            [json!("redd"), json!(""), json!("#12"), json!("#0072b280"), json!("none"), json!([0, 1])]
        {
            assert_eq!(colour(&value), None, "{value}");
        }
    }
}
