//! Pages that need nothing but a browser: a replay of an episode, and an editor of maps.
//!
//! A page is one file with everything inside, and its content security policy forbids it any network.

mod pack;
mod page;

use pogema_core::Error;

use crate::Film;
use page::Page;

/// The page that replays an episode.
///
/// # Errors
/// If the lists of a step are not as long as there are agents, if an agent is off the map, or if it is not next
/// to where it was a step before.
pub fn replay(film: &Film, title: &str) -> Result<String, Error> {
    let data = pack::pack(film)?;
    let page = Page {
        title,
        style: concat!(include_str!("shared/base.css"), include_str!("replay/replay.css")),
        body: include_str!("replay/replay.html"),
        data: &data,
        script: concat!(
            "(() => {\n\"use strict\";\n",
            include_str!("shared/dom.js"),
            include_str!("shared/view.js"),
            include_str!("shared/list.js"),
            include_str!("shared/paint.js"),
            include_str!("replay/film.js"),
            include_str!("replay/scene.js"),
            include_str!("replay/panel.js"),
            include_str!("replay/timeline.js"),
            include_str!("replay/player.js"),
            include_str!("replay/main.js"),
            "})();\n",
        ),
    };
    Ok(page.text())
}
