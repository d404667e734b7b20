//! The skeleton that all pages share.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use minijinja::HtmlEscape;
use sha2::{Digest, Sha256};

/// The parts of a page.
pub struct Page<'a> {
    /// Plain text from any source.
    pub title: &'a str,
    pub style: &'a str,
    pub body: &'a str,
    /// JSON for the script.
    pub data: &'a str,
    pub script: &'a str,
    /// A page that this page may show in a frame; its style and script are also allowed.
    pub inner: Option<&'a Self>,
}

impl Page<'_> {
    /// Returns the page as one file.
    ///
    /// The content security policy allows only the styles and scripts of this page and of its inner page, by their
    /// hashes. Code hidden in a title or a map therefore never runs.
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
            // The data must not contain `</script>`.
            data = self.data.replace('<', "\\u003c"),
            script = self.script,
        )
    }
}

fn hash(text: &str) -> String {
    STANDARD.encode(Sha256::digest(text))
}
