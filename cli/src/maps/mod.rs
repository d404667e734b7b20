//! `pogema maps`: lists, shows, generates, converts and analyses maps.

mod convert;
mod generate;
mod show;
mod stats;

use std::path::{Path, PathBuf};

use clap::builder::TypedValueParser;
use clap::{Args, Subcommand};
use pogema_core::Error;
use pogema_maps::Library;
use pogema_maps::files::{MovingAiOptions, read_maps};
use pogema_maps::formats::NamedMap;

use crate::output::{check_writable, print_bytes, tell};

#[derive(Args, Debug)]
pub struct Maps {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// List the built-in and additional maps, or all maps whose names match a pattern
    List(show::List),
    /// Draw a map
    Show(show::Show),
    /// Generate maps with the generators of the POGEMA paper
    Generate(Box<generate::Generate>),
    /// Convert maps of other formats to a map set
    Import(convert::Import),
    /// Convert maps to other formats
    Export(convert::Export),
    /// Cut a large map into tiles
    Tiles(convert::Tiles),
    /// Write an HTML page in which maps can be drawn
    Editor(show::Editor),
    /// Show statistics of maps and, for a scenario, lower bounds and proofs that it is unsolvable
    Stats(stats::Stats),
}

impl Maps {
    pub fn run(&self) -> Result<(), Error> {
        match &self.command {
            Command::List(list) => list.run(),
            Command::Show(show) => show.run(),
            Command::Generate(generate) => generate.run(),
            Command::Import(import) => import.run(),
            Command::Export(export) => export.run(),
            Command::Tiles(tiles) => tiles.run(),
            Command::Editor(editor) => editor.run(),
            Command::Stats(stats) => stats.run(),
        }
    }
}

/// Files and folders with additional maps.
#[derive(Args, Debug, Default)]
pub struct Sources {
    /// Additional maps: a map set, a map file, a zip archive, or a folder of those; may be given several times
    #[arg(long = "maps", value_name = "PATH")]
    paths: Vec<PathBuf>,
}

impl Sources {
    /// Returns the given files and folders.
    pub fn paths(&self) -> &[PathBuf] {
        &self.paths
    }

    /// Returns the built-in maps and those of the files. If none of them matches the name or pattern, adds the maps of
    /// the paper that the name or pattern selects.
    pub fn library(&self, name: Option<&str>) -> Result<Library, Error> {
        let mut library = Library::built_in();
        for path in &self.paths {
            for name in library.register(read_maps(path, MovingAiOptions::default())?) {
                tell(&format!("warning: {}: a second map named `{name}` replaces the first", path.display()));
            }
        }
        library.add_published(name)?;
        Ok(library)
    }

    /// Returns the maps that a word selects: the one of that name, those of a file or folder, or all whose names match.
    pub fn resolve(&self, word: &str) -> Result<Vec<NamedMap>, Error> {
        let library = self.library(Some(word))?;
        if let Ok(text) = library.map(word) {
            return Ok(vec![NamedMap { name: word.into(), text: text.clone() }]);
        }
        if Path::new(word).exists() {
            return read_maps(Path::new(word), MovingAiOptions::default());
        }
        let names = library.matching(word).map_err(|error| no_such_file(word, &error))?;
        let map = |name: &str| Ok(NamedMap { name: name.into(), text: library.map(name)?.clone() });
        names.into_iter().map(map).collect()
    }
}

/// Returns an error about a word that names neither a map nor a file.
pub fn no_such_file(word: &str, error: &Error) -> Error {
    Error::io(word, format!("no such file; {error}"))
}

/// Returns an error about a word that does not select exactly one map; `purpose` says what requires one.
fn ambiguous_map(word: &str, found: usize, purpose: &str) -> Error {
    Error::request(format!("`{word}` matches {found} maps, expected one {purpose}"))
}

/// Returns a parser of a number of agents.
fn number_of_agents() -> impl TypedValueParser<Value = usize> {
    clap::value_parser!(u64).range(1..).map(|number| usize::try_from(number).unwrap_or(usize::MAX))
}

/// Writes bytes to a file, or to standard output if there is no path.
fn write_out(path: Option<&Path>, bytes: &[u8]) -> Result<(), Error> {
    match path {
        Some(path) => check_writable(path).and_then(|()| pogema_conformance::files::write(path, bytes)),
        None => print_bytes(bytes),
    }
}
