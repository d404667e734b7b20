//! The report of an evaluation on one page: tables, plots, replays of the worst and best episodes, and provenance.

mod picks;

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use pogema_core::{Error, counted};
use pogema_render::html::{Album, fill, pack};
use serde_json::{Value, json};

use picks::ranking;
pub use picks::{Pick, picks};

use crate::episode_configs::EpisodeConfigs;
use crate::groups::plain_text;
use crate::manifest::Manifest;
use crate::replay::differences;
use crate::results::{Pairs, Results, Row};
use crate::suite::{Algorithm, Suite};
use crate::tree::Node;
use crate::views::{ImageFormat, Shown, Table, View};

/// Number of worst episodes, and of best episodes, shown for each algorithm.
pub const SHOWN: usize = 3;

/// An episode shown in the report, with its replay.
#[derive(Clone, Debug)]
pub struct Replay {
    /// The episode.
    pub pick: Pick,
    /// The replay from [`pogema_render::html::pack`], or one line on why there is none.
    pub film: Result<String, String>,
    /// The metrics in which the replay differs from the results.
    pub differences: Vec<String>,
}

impl Replay {
    /// Replays an episode if its algorithm is built in. Another thread may set `stop` to end the call soon.
    pub fn of(
        pick: Pick,
        results: &Results,
        suite: &Suite,
        environments: &EpisodeConfigs,
        stop: &Arc<AtomicBool>,
    ) -> Self {
        let again = suite.play_again(environments, &pick.algorithm, pick.episode, stop);
        match again.and_then(|(metrics, trace)| Ok((metrics, pack(&trace)?))) {
            Ok((metrics, film)) => Self::played(pick, results, &metrics, film),
            Err(error) => Self::failed(pick, error.to_string()),
        }
    }

    /// Creates a replay from an episode that the caller played again.
    pub fn played(pick: Pick, results: &Results, metrics: &Pairs, film: String) -> Self {
        let differences = differences(&results.rows[pick.row], metrics);
        Self { pick, film: Ok(film), differences }
    }

    /// Creates an entry for an episode that cannot be replayed, with the reason.
    pub fn failed(pick: Pick, why: String) -> Self {
        Self { pick, film: Err(why), differences: Vec::new() }
    }
}

/// Returns the page with the views of the suite, or with a table of all metrics if the suite has no views.
///
/// # Errors
/// If a view is invalid, or a plot cannot be drawn.
pub fn page(
    suite: &Suite,
    manifest: &Manifest,
    results: &Results,
    replays: &[Replay],
) -> Result<String, Error> {
    let stem = suite.path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let title = stem.unwrap_or_else(|| "evaluation".into());
    let mut album = Album { title, style: include_str!("report.css").into(), ..Album::default() };
    let mut episodes: HashMap<&str, Vec<Value>> = HashMap::new();
    for replay in replays.iter().filter(|replay| suite.algorithm(&replay.pick.algorithm).is_some()) {
        let shown = episode(replay, &results.rows[replay.pick.row], &mut album);
        episodes.entry(&replay.pick.algorithm).or_default().push(shown);
    }
    let algorithm = |algorithm: &Algorithm| {
        let parameters = algorithm.parameters.iter().map(|(key, node)| format!("{key}: {}", node.value()));
        let parameters: Vec<String> = std::iter::once(algorithm.name.clone()).chain(parameters).collect();
        let episodes = episodes.get(algorithm.key.as_str());
        json!({"name": algorithm.key, "parameters": parameters.join(", "), "episodes": episodes})
    };
    let page = json!({
        "facts": facts(suite, results),
        "notes": results.notes,
        "ranking": ranking(results),
        "views": sections(suite, results)?,
        "algorithms": suite.algorithms.iter().map(algorithm).collect::<Vec<_>>(),
        "runs": manifest.runs,
        "suite": suite_text(suite),
    });
    album.body = fill(include_str!("report.html"), page)?;
    album.text()
}

/// Returns the text of the suite's file, and of the file that replaced its algorithms.
fn suite_text(suite: &Suite) -> String {
    let Some(file) = &suite.replacement else { return suite.text.clone() };
    format!("{}\n# Replaces the algorithms above: {}\n{}", suite.text, file.path.display(), file.text)
}

fn facts(suite: &Suite, results: &Results) -> Vec<(&'static str, String)> {
    let names = results.algorithms();
    let expected = suite.environments.len();
    let missing = suite.algorithms.iter().filter_map(|Algorithm { key, .. }| {
        let number = results.rows.iter().filter(|row| row.algorithm == *key).count();
        (number < expected).then(|| format!("{key} has {number} of {expected}"))
    });
    let missing: Vec<String> = missing.collect();
    let mut facts = vec![
        ("algorithms", names.join(", ")),
        ("episodes", format!("{} in {}", results.rows.len(), counted(expected, "environment"))),
    ];
    if !missing.is_empty() {
        facts.push(("missing", missing.join(", ")));
    }
    facts
}

fn sections(suite: &Suite, results: &Results) -> Result<Vec<Value>, Error> {
    let all = Node::parse("type: tabular\ndrop_keys: [seed, map_name]")?;
    let usual = [("means".to_owned(), all)];
    let views = if suite.views.is_empty() { &usual[..] } else { &suite.views };
    let show = |(name, node): &(String, Node)| {
        let view = View::read(name, node).map_err(|error| suite.in_file(error))?.beside(&suite.path);
        // A view that fails must not hide the others, so its error becomes a note.
        let shown = view
            .show(name, results, None)
            .unwrap_or_else(|error| Shown { notes: vec![error.to_string()], ..Shown::default() });
        section(name, shown)
    };
    views.iter().map(show).collect()
}

fn section(name: &str, shown: Shown) -> Result<Value, Error> {
    let plot = |svg: Vec<u8>| format!("data:image/svg+xml;base64,{}", STANDARD.encode(svg));
    let plots = shown.pictures.iter().map(|picture| picture.bytes(ImageFormat::Svg).map(plot));
    Ok(json!({
        "name": name,
        "plots": plots.collect::<Result<Vec<_>, _>>()?,
        "tables": shown.tables.iter().map(grid).collect::<Vec<_>>(),
        "notes": shown.notes,
    }))
}

fn grid(table: &Table) -> Value {
    let figures: Vec<bool> = (0..table.head.len()).map(|column| table.is_numeric(column)).collect();
    json!({"head": table.head, "rows": table.texts(), "figures": figures, "remark": table.remark})
}

fn episode(replay: &Replay, row: &Row, album: &mut Album) -> Value {
    let Pick { algorithm, episode, is_worst, by, why, .. } = &replay.pick;
    let settings = row.settings.iter().map(|(name, value)| format!("{name} {}", plain_text(value)));
    let place = replay.film.as_ref().ok().map(|film| {
        album.replays.push((format!("{algorithm}, episode {episode}: {why}"), film.clone()));
        album.replays.len() - 1
    });
    let remark = match &replay.film {
        Err(reason) => reason.clone(),
        Ok(_) if replay.differences.is_empty() => String::new(),
        Ok(_) => format!("the replay differs from the results: {}", replay.differences.join("; ")),
    };
    json!({
        "number": episode,
        "is_worst": is_worst,
        "by": by,
        "settings": settings.collect::<Vec<_>>().join(", "),
        "why": why,
        "replay": place,
        "remark": remark,
    })
}
