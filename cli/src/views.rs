//! `pogema views`: tables and plots of results.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use pogema_core::Error;
use pogema_maps::files::write_whole;
use pogema_maps::nearest;
use pogema_toolbox::six::Definition;
use pogema_toolbox::views::{Format, Kind, Shown, View, read_views};
use pogema_toolbox::{Node, Results};

use crate::output::say;

/// The suite in a folder of results.
const SUITE: &str = "suite.yaml";

#[derive(Args, Debug)]
pub struct Views {
    /// Folders of results, which are shown together
    #[arg(required = true, value_name = "FOLDER")]
    folders: Vec<PathBuf>,
    /// A YAML file with `results_views`, in place of the one that is with the results
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Only the view of this name; may be given several times
    #[arg(long = "view", value_name = "NAME")]
    names: Vec<String>,
    /// How tables are written, whatever the views say
    #[arg(long, value_enum)]
    format: Option<TableFormat>,
    /// The format of plots, whatever the views say
    #[arg(long, value_enum, value_name = "FORMAT")]
    plots: Option<PlotFormat>,
    /// Where plots are written; by default `views` in the first folder
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// The six metrics by this definition, in place of views; beside `--config` or `--view`, the definition for theirs
    #[arg(long, value_enum, value_name = "DEFINITION")]
    six: Option<SixDefinition>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum TableFormat {
    Terminal,
    Markdown,
    Latex,
    Csv,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum PlotFormat {
    Svg,
    Pdf,
    Png,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum SixDefinition {
    Published,
    Paper,
}

impl Views {
    /// Shows all views that can be shown; exit status 2 if one could not.
    pub fn run(&self) -> Result<ExitCode, Error> {
        let views = self.chosen()?;
        let results = Results::read(&self.folders)?;
        for note in &results.notes {
            eprintln!("note: {note}");
        }
        let definition = self.six.map(|definition| match definition {
            SixDefinition::Published => Definition::Published,
            SixDefinition::Paper => Definition::Paper,
        });
        let mut status = ExitCode::SUCCESS;
        for (number, (name, view)) in views.iter().enumerate() {
            match view.show(name, &results, definition) {
                Ok(shown) => self.tell(number, name, view, &shown)?,
                Err(error) => {
                    eprintln!("error: {error}");
                    status = ExitCode::from(2);
                }
            }
        }
        Ok(status)
    }

    /// The views that were asked for.
    fn chosen(&self) -> Result<Vec<(String, View)>, Error> {
        if self.six.is_some() && self.config.is_none() && self.names.is_empty() {
            let star = View::read("six", &Node::parse("type: radar")?)?;
            return Ok(vec![("six".to_owned(), star)]);
        }
        let path = self.config.clone().map_or_else(|| self.own_config(), Ok)?;
        let views = read_views(&path)?;
        let known = || views.iter().map(|(name, _)| name.as_str());
        if let Some(name) = self.names.iter().find(|&name| !known().any(|known| known == name)) {
            let hint = nearest(name, known()).map(|hint| format!("; the nearest one is `{hint}`"));
            return Err(Error::io(&path, format!("no view `{name}`{}", hint.unwrap_or_default())));
        }
        let is_chosen = |name: &String| self.names.is_empty() || self.names.contains(name);
        Ok(views.into_iter().filter(|(name, _)| is_chosen(name)).collect())
    }

    /// The YAML file of the first folder that has one.
    fn own_config(&self) -> Result<PathBuf, Error> {
        let named = |folder: &PathBuf| {
            let whole = folder.canonicalize().unwrap_or_else(|_| folder.clone());
            let name = whole.file_name().unwrap_or_default().to_string_lossy().into_owned();
            [folder.join(SUITE), folder.join(format!("{name}.yaml"))]
        };
        let all: Vec<PathBuf> = self.folders.iter().flat_map(named).collect();
        let found = all.iter().find(|path| path.is_file()).cloned();
        found.ok_or_else(|| {
            let looked =
                all.iter().map(|path| format!("`{}`", path.display())).collect::<Vec<_>>().join(", ");
            Error::State { reason: format!("no views: expected {looked}, or `--config`") }
        })
    }

    /// Prints the tables of a view, writes its plots and says what it left out.
    fn tell(&self, number: usize, name: &str, view: &View, shown: &Shown) -> Result<(), Error> {
        let format = match self.format {
            Some(TableFormat::Terminal) => Format::Terminal,
            Some(TableFormat::Markdown) => Format::Markdown,
            Some(TableFormat::Latex) => Format::Latex,
            Some(TableFormat::Csv) => Format::Csv,
            None => view.format().unwrap_or(Format::Terminal),
        };
        for table in &shown.tables {
            let gap = if number == 0 { "" } else { "\n" };
            let heading = match format {
                Format::Terminal => format!("{name}\n"),
                Format::Markdown => format!("**{name}**\n\n"),
                Format::Latex => format!("% {name}\n"),
                Format::Csv => String::new(),
            };
            say(&format!("{gap}{heading}{}", table.text(format)))?;
        }
        for picture in &shown.pictures {
            let kind = match self.plots {
                Some(PlotFormat::Svg) => Kind::Svg,
                Some(PlotFormat::Pdf) => Kind::Pdf,
                Some(PlotFormat::Png) => Kind::Png,
                None => picture.kind,
            };
            let path = self.write(name, kind, &picture.bytes(kind)?)?;
            eprintln!("wrote {}", path.display());
        }
        for note in &shown.notes {
            eprintln!("note: {note}");
        }
        Ok(())
    }

    fn write(&self, name: &str, kind: Kind, bytes: &[u8]) -> Result<PathBuf, Error> {
        let folder = self.out.clone().unwrap_or_else(|| self.folders[0].join("views"));
        std::fs::create_dir_all(&folder).map_err(|error| Error::io(&folder, error))?;
        let path = folder.join(Path::new(&format!("{}.{}", file_name(name), kind.extension())));
        write_whole(&path, bytes)?;
        Ok(path)
    }
}

/// A view's name with nothing in it that a file's name may not have.
fn file_name(name: &str) -> String {
    let is_plain = |letter: char| letter.is_alphanumeric() || "-_. ".contains(letter);
    let plain: String = name.chars().map(|letter| if is_plain(letter) { letter } else { '_' }).collect();
    plain.trim_start_matches('.').to_owned()
}
