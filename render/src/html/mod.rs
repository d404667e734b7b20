//! Pages for the browser: a replay of an episode, a map editor, and albums of replays.
//!
//! A page is one self-contained file, and its content security policy forbids all network access.

mod album;
mod pack;
mod page;
mod template;

use std::sync::LazyLock;

use pogema_core::{Error, Trace};

pub use album::Album;
pub use pack::pack;
use page::Page;
pub use template::fill;

const SHARED: [&str; 4] = [
    include_str!("shared/dom.js"),
    include_str!("shared/view.js"),
    include_str!("shared/list.js"),
    include_str!("shared/paint.js"),
];
const REPLAY: [&str; 6] = [
    include_str!("replay/episode.js"),
    include_str!("replay/scene.js"),
    include_str!("replay/panel.js"),
    include_str!("replay/timeline.js"),
    include_str!("replay/player.js"),
    include_str!("replay/main.js"),
];
const EDITOR: [&str; 9] = [
    include_str!("editor/text.js"),
    include_str!("editor/blocks.js"),
    include_str!("editor/yaml.js"),
    include_str!("editor/grid.js"),
    include_str!("editor/check.js"),
    include_str!("editor/canvas.js"),
    include_str!("editor/tools.js"),
    include_str!("editor/files.js"),
    include_str!("editor/main.js"),
];

/// Returns the page that replays an episode.
///
/// # Errors
/// Those of [`crate::check()`].
pub fn replay(trace: &Trace, title: &str) -> Result<String, Error> {
    Ok(replay_page(title, &pack(trace)?).text())
}

/// Returns the replay page for the output of [`pack`].
fn replay_page<'a>(title: &'a str, data: &'a str) -> Page<'a> {
    static SCRIPT: LazyLock<String> = LazyLock::new(|| script(&[&SHARED, &REPLAY]));
    Page {
        title,
        style: concat!(include_str!("shared/base.css"), include_str!("replay/replay.css")),
        body: include_str!("replay/replay.html"),
        data,
        script: &SCRIPT,
        inner: None,
    }
}

/// Returns the map editor, which reads and writes map text and POGEMA configs.
pub fn editor() -> String {
    let page = Page {
        title: "Map editor",
        style: concat!(include_str!("shared/base.css"), include_str!("editor/editor.css")),
        body: include_str!("editor/editor.html"),
        data: "null",
        script: &script(&[&SHARED, &EDITOR]),
        inner: None,
    };
    page.text()
}

/// Joins files into one script whose names are not global.
fn script(parts: &[&[&str]]) -> String {
    format!("(() => {{\n\"use strict\";\n{}}})();\n", parts.concat().concat())
}

#[cfg(test)]
mod tests;
