//! One page with all that came of an evaluation: tables, plots, replays of the worst and best episodes, and how it was
//! made.

mod picks;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use pogema_core::Error;
use pogema_render::html::{Album, fill, pack};
use serde::Serialize;

pub use picks::{Pick, picks};

use crate::environments::Environments;
use crate::manifest::{Manifest, Run};
use crate::replay::differences;
use crate::results::{Pairs, Results, Row};
use crate::suite::Suite;
use crate::tree::Node;
use crate::views::{ImageFormat, Shown, Table, View};

/// So many of the worst and of the best episodes are shown of each algorithm.
pub const SHOWN: usize = 3;

/// An episode that is shown, and what is known of it.
#[derive(Clone, Debug)]
pub struct Replay {
    /// Which it is.
    pub pick: Pick,
    /// What [`pogema_render::html::pack`] made of it, or why it cannot be replayed, in one line.
    pub film: Result<String, String>,
    /// In what figures it came out differently when it was played again.
    pub differences: Vec<String>,
}

impl Replay {
    /// Plays an episode again, if its algorithm is built in.
    pub fn of(pick: Pick, results: &Results, suite: &Suite, environments: &Environments) -> Self {
        let again = suite.play_again(environments, &pick.algorithm, pick.episode);
        match again.and_then(|(metrics, trace)| Ok((metrics, pack(&trace)?))) {
            Ok((metrics, film)) => Self::played(pick, results, &metrics, film),
            Err(error) => Self::failed(pick, error.to_string()),
        }
    }

    /// An episode that somebody played again.
    pub fn played(pick: Pick, results: &Results, metrics: &Pairs, film: String) -> Self {
        let differences = differences(&results.rows[pick.row], metrics);
        Self { pick, film: Ok(film), differences }
    }

    /// An episode that cannot be replayed, and why.
    pub fn failed(pick: Pick, why: String) -> Self {
        Self { pick, film: Err(why), differences: Vec::new() }
    }
}

/// What the template is filled with.
#[derive(Serialize)]
struct Page {
    facts: Vec<(&'static str, String)>,
    notes: Vec<String>,
    views: Vec<Section>,
    algorithms: Vec<Algorithm>,
    runs: Vec<Run>,
    suite: String,
}

#[derive(Serialize)]
struct Section {
    name: String,
    tables: Vec<Grid>,
    /// Plots as addresses that hold them.
    plots: Vec<String>,
    notes: Vec<String>,
}

#[derive(Serialize)]
struct Grid {
    head: Vec<String>,
    rows: Vec<Vec<String>>,
    /// Whether each column holds figures.
    figures: Vec<bool>,
    remark: Option<String>,
}

#[derive(Serialize)]
struct Algorithm {
    name: String,
    parameters: String,
    episodes: Vec<Episode>,
}

#[derive(Serialize)]
struct Episode {
    number: usize,
    is_worst: bool,
    settings: String,
    why: String,
    /// Its place among the replays.
    replay: Option<usize>,
    remark: String,
}

/// The page, for the views of the suite, or for a table of all figures if it has none.
///
/// # Errors
/// If a view is wrong, or a plot cannot be drawn.
pub fn page(
    suite: &Suite,
    manifest: &Manifest,
    results: &Results,
    replays: &[Replay],
) -> Result<String, Error> {
    let stem = suite.path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let title = stem.unwrap_or_else(|| "evaluation".into());
    let mut album = Album { title, style: include_str!("report.css").into(), ..Album::default() };
    let mut algorithms: Vec<Algorithm> = suite.algorithms.iter().map(algorithm).collect();
    for replay in replays {
        let found = algorithms.iter_mut().find(|algorithm| algorithm.name == replay.pick.algorithm);
        if let Some(algorithm) = found {
            algorithm.episodes.push(episode(replay, &results.rows[replay.pick.row], &mut album));
        }
    }
    let page = Page {
        facts: facts(suite, results),
        notes: results.notes.clone(),
        views: sections(suite, results)?,
        algorithms,
        runs: manifest.runs.clone(),
        suite: played(suite),
    };
    album.body = fill(include_str!("report.html"), page)?;
    album.text()
}

/// The suite's file, and the file that replaced its algorithms.
fn played(suite: &Suite) -> String {
    let Some(file) = &suite.replacement else { return suite.text.clone() };
    format!("{}\n# In place of these algorithms: {}\n{}", suite.text, file.path.display(), file.text)
}

fn facts(suite: &Suite, results: &Results) -> Vec<(&'static str, String)> {
    let names = results.algorithms();
    let expected = suite.environments.len();
    let of = |name: &String| results.rows.iter().filter(|row| row.algorithm == *name).count();
    let missing: Vec<String> = suite
        .algorithms
        .iter()
        .map(|algorithm| (&algorithm.key, of(&algorithm.key)))
        .filter(|(_, number)| *number < expected)
        .map(|(name, number)| format!("{name} has {number} of {expected}"))
        .collect();
    let mut facts = vec![
        ("algorithms", names.join(", ")),
        ("episodes", format!("{} in {expected} environments", results.rows.len())),
    ];
    if !missing.is_empty() {
        facts.push(("missing", missing.join(", ")));
    }
    facts
}

fn sections(suite: &Suite, results: &Results) -> Result<Vec<Section>, Error> {
    let all = Node::parse("type: tabular\ndrop_keys: [seed, map_name]")?;
    let usual = [("means".to_owned(), all)];
    let views = if suite.views.is_empty() { &usual[..] } else { &suite.views };
    let show = |(name, node): &(String, Node)| {
        let view = View::read(name, node).map_err(|error| suite.in_file(error))?.beside(&suite.path);
        // What cannot be shown is no reason to show nothing.
        let shown = view
            .show(name, results, None)
            .unwrap_or_else(|error| Shown { notes: vec![error.to_string()], ..Shown::default() });
        section(name, shown)
    };
    views.iter().map(show).collect()
}

fn section(name: &str, shown: Shown) -> Result<Section, Error> {
    let plot = |svg: Vec<u8>| format!("data:image/svg+xml;base64,{}", STANDARD.encode(svg));
    let plots = shown.pictures.iter().map(|picture| picture.bytes(ImageFormat::Svg).map(plot));
    Ok(Section {
        name: name.to_owned(),
        plots: plots.collect::<Result<_, _>>()?,
        tables: shown.tables.iter().map(grid).collect(),
        notes: shown.notes,
    })
}

fn grid(table: &Table) -> Grid {
    Grid {
        head: table.head.clone(),
        rows: table.texts(),
        figures: (0..table.head.len()).map(|column| table.is_figure(column)).collect(),
        remark: table.remark.clone(),
    }
}

fn algorithm(algorithm: &crate::suite::Algorithm) -> Algorithm {
    let parameters = algorithm.parameters.iter().map(|(key, node)| format!("{key}: {}", node.value()));
    let parameters: Vec<String> = std::iter::once(algorithm.name.clone()).chain(parameters).collect();
    Algorithm { name: algorithm.key.clone(), parameters: parameters.join(", "), episodes: Vec::new() }
}

fn episode(replay: &Replay, row: &Row, album: &mut Album) -> Episode {
    let Pick { algorithm, episode, is_worst, why, .. } = &replay.pick;
    let settings = row.settings.iter().map(|(name, value)| {
        let value = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        format!("{name} {value}")
    });
    let place = replay.film.as_ref().ok().map(|film| {
        album.replays.push((format!("{algorithm}, episode {episode}: {why}"), film.clone()));
        album.replays.len() - 1
    });
    let remark = match &replay.film {
        Err(reason) => reason.clone(),
        Ok(_) if replay.differences.is_empty() => String::new(),
        Ok(_) => format!("played again it came out otherwise: {}", replay.differences.join("; ")),
    };
    Episode {
        number: *episode,
        is_worst: *is_worst,
        settings: settings.collect::<Vec<_>>().join(", "),
        why: why.clone(),
        replay: place,
        remark,
    }
}
