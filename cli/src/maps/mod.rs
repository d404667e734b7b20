//! `pogema maps`: maps to look at, to make, to convert and to judge.

mod convert;
mod generate;
mod show;
mod stats;

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use pogema_core::Error;
use pogema_maps::Library;
use pogema_maps::files::{Reading, read_maps};
use pogema_maps::formats::NamedMap;

use crate::output::{check_writable, said};

#[derive(Args, Debug)]
pub struct Maps {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// The names of all maps, or of those that a pattern matches
    List(show::List),
    /// A picture of a map
    Show(show::Show),
    /// Maps as the paper's generators make them
    Generate(Box<generate::Generate>),
    /// Maps of other formats as a map set
    Import(convert::Import),
    /// Maps in other formats
    Export(convert::Export),
    /// A large map cut into tiles
    Tiles(convert::Tiles),
    /// A page to draw maps on, for any browser
    Editor(show::Editor),
    /// Figures of maps, and of a scenario: who cannot reach their goals, and what cannot be solved
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

/// Where further maps are.
#[derive(Args, Debug, Default)]
pub struct Sources {
    /// A map set, a map file, a zip archive, or a folder of those; may be given several times
    #[arg(long = "maps", value_name = "PATH")]
    paths: Vec<PathBuf>,
}

impl Sources {
    /// The files and folders that are named.
    pub fn paths(&self) -> &[PathBuf] {
        &self.paths
    }

    /// The maps that come with the program and those of the files.
    pub fn library(&self) -> Result<Library, Error> {
        let mut library = Library::built_in();
        for path in &self.paths {
            for name in library.register(read_maps(path, Reading::default())?) {
                eprintln!(
                    "warning: {}: a second map named `{name}` takes the place of the first",
                    path.display()
                );
            }
        }
        Ok(library)
    }

    /// The maps that a word means: those of a file or folder, or those whose names match.
    pub fn meant_by(&self, word: &str) -> Result<Vec<NamedMap>, Error> {
        let library = self.library()?;
        if let Ok(text) = library.map(word) {
            return Ok(vec![NamedMap { name: word.into(), text: text.clone() }]);
        }
        if Path::new(word).exists() {
            return read_maps(Path::new(word), Reading::default());
        }
        let names = library.matching(word)?;
        let map = |name: &str| Ok(NamedMap { name: name.into(), text: library.map(name)?.clone() });
        names.into_iter().map(map).collect()
    }
}

/// An error about a word that means several maps where there has to be one.
fn not_one(word: &str, found: usize, what: &str) -> Error {
    Error::request(format!("`{word}` means {found} maps, {what} one"))
}

/// Writes what was asked for, to a file or to standard output.
fn write_out(path: Option<&Path>, bytes: &[u8]) -> Result<(), Error> {
    use std::io::Write;
    if let Some(path) = path {
        check_writable(path)?;
        return pogema_conformance::files::write(path, bytes);
    }
    let mut output = std::io::stdout().lock();
    said(output.write_all(bytes).and_then(|()| output.flush()))
}
