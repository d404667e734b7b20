//! The file formats of plots.

use pogema_core::words;

words! {
    /// The format of a picture; its keyword is the file extension.
    #[derive(Default)]
    pub enum ImageFormat {
        /// Vector graphics for the web.
        Svg = "svg",
        /// Vector graphics with an embedded font, for papers.
        #[default]
        Pdf = "pdf",
        /// Pixels.
        Png = "png",
    }
}
