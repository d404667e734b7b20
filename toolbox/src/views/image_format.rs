//! The file formats of plots.

use pogema_core::words;

words! {
    /// The format of a picture, whose word is the extension of its files.
    #[derive(Default)]
    pub enum ImageFormat {
        /// Lines and letters, for the web.
        Svg = "svg",
        /// Lines and letters with their font, for papers.
        #[default]
        Pdf = "pdf",
        /// Dots.
        Png = "png",
    }
}
