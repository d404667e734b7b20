//! Pages with replays of many episodes, each opened when it is asked for.

use pogema_core::Error;
use serde_json::{Value, json};

use super::page::Page;
use super::{SHARED, replay_page, script};

/// What stands in the page of a replay where its own title and data go.
const TITLE: &str = "@title@";
const DATA: &str = "@data@";

/// A page whose body may have buttons with `data-replay`, the place of a replay in the album.
#[derive(Clone, Debug, Default)]
pub struct Album {
    /// Plain text.
    pub title: String,
    /// Rules of style besides those of all pages.
    pub style: String,
    /// HTML without any style or script of its own.
    pub body: String,
    /// For each replay its title, and what [`super::pack`] made of the episode.
    pub replays: Vec<(String, String)>,
}

impl Album {
    /// The page as one file, the page of a replay in it once.
    ///
    /// # Errors
    /// If a replay is not what was packed.
    pub fn text(&self) -> Result<String, Error> {
        let read = |(title, data): &(String, String)| {
            let film = serde_json::from_str::<Value>(data);
            let film = film.map_err(|error| Error::Corrupt {
                what: format!("replay `{title}`"),
                reason: error.to_string(),
            })?;
            Ok(json!({"title": title, "film": film}))
        };
        let films = self.replays.iter().map(read).collect::<Result<Vec<_>, Error>>()?;
        let style = [include_str!("shared/base.css"), include_str!("album/album.css"), &self.style].concat();
        let inner = replay_page(TITLE, DATA);
        let data = json!({"frame": inner.text(), "films": films}).to_string();
        let page = Page {
            title: &self.title,
            style: &style,
            body: &[&self.body, include_str!("album/player.html")].concat(),
            data: &data.replace('<', "\\u003c"),
            script: &script(&[&SHARED[..1], &[include_str!("album/album.js")]]),
            inner: Some(&inner),
        };
        Ok(page.text())
    }
}
