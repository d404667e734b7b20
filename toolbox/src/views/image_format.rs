//! The file formats of plots.

/// The format of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageFormat {
    /// Lines and letters, for the web.
    Svg,
    /// Lines and letters with their font, for papers.
    Pdf,
    /// Dots.
    Png,
}

impl ImageFormat {
    /// What such files end with.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Svg => "svg",
            Self::Pdf => "pdf",
            Self::Png => "png",
        }
    }
}
