//! Pages with replays of many episodes. A replay is built when a reader opens it.

use pogema_core::Error;
use serde_json::{Value, json};

use super::page::Page;
use super::{SHARED, replay_page, script};

/// Placeholders for the title and the data in the page of a replay.
const TITLE: &str = "@title@";
const DATA: &str = "@data@";

/// A page with replays. Buttons in its body open the replays; the attribute `data-replay` of a button is the index of
/// its replay in the album.
#[derive(Clone, Debug, Default)]
pub struct Album {
    /// Plain text.
    pub title: String,
    /// CSS rules, in addition to those of all pages.
    pub style: String,
    /// HTML without style or script elements.
    pub body: String,
    /// The title and the output of [`super::pack`] for each replay.
    pub replays: Vec<(String, String)>,
}

impl Album {
    /// Returns the page as one file, which contains the replay page once.
    ///
    /// # Errors
    /// [`Error::Corrupt`] if a replay is not valid JSON.
    pub fn text(&self) -> Result<String, Error> {
        let read = |(title, data): &(String, String)| {
            let episode = serde_json::from_str::<Value>(data);
            let episode = episode.map_err(|error| Error::Corrupt {
                what: format!("replay `{title}`"),
                reason: error.to_string(),
            })?;
            Ok(json!({"title": title, "episode": episode}))
        };
        let episodes = self.replays.iter().map(read).collect::<Result<Vec<_>, Error>>()?;
        let style = [include_str!("shared/base.css"), include_str!("album/album.css"), &self.style].concat();
        let inner = replay_page(TITLE, DATA);
        let data = json!({"frame": inner.text(), "episodes": episodes}).to_string();
        let page = Page {
            title: &self.title,
            style: &style,
            body: &[&self.body, include_str!("album/player.html")].concat(),
            data: &data,
            script: &script(&[&SHARED[..1], &[include_str!("album/album.js")]]),
            inner: Some(&inner),
        };
        Ok(page.text())
    }
}
