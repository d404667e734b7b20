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
    /// The page that it may show inside of itself, whose style and script are allowed too.
    pub inner: Option<&'a Self>,
}

impl Page<'_> {
    /// The page as one file. Its policy names its own style and script by their hashes, so that nothing else runs,
    /// whatever a title or a map might smuggle in.
    pub fn text(&self) -> String {
        let all = |of: fn(&Self) -> &str| {
            let pages = std::iter::once(self).chain(self.inner);
            pages.map(|page| format!("'sha256-{}'", hash(of(page)))).collect::<Vec<_>>().join(" ")
        };
        format!(
            include_str!("page.html"),
            title = HtmlEscape(self.title),
            styles = all(|page| page.style),
            scripts = all(|page| page.script),
            frames = if self.inner.is_some() { " frame-src blob:;" } else { "" },
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
