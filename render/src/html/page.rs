//! The frame that all pages share.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use minijinja::HtmlEscape;
use sha2::{Digest, Sha256};

/// What goes into a page.
pub struct Page<'a> {
    /// Plain text, from wherever.
    pub title: &'a str,
    pub style: &'a str,
    pub body: &'a str,
    /// JSON for the script, in which no `<` may stand.
    pub data: &'a str,
    pub script: &'a str,
}

impl Page<'_> {
    /// The page as one file. Its policy names its own style and script by their hashes, so that nothing else runs,
    /// whatever a title or a map might smuggle in.
    pub fn text(&self) -> String {
        format!(
            include_str!("page.html"),
            title = HtmlEscape(self.title),
            style_hash = hash(self.style),
            script_hash = hash(self.script),
            style = self.style,
            body = self.body,
            data = self.data,
            script = self.script,
        )
    }
}

fn hash(text: &str) -> String {
    STANDARD.encode(Sha256::digest(text))
}
