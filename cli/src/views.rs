//! `pogema views`: tables and plots of results.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use pogema_core::Error;
use pogema_toolbox::six::Definition;
use pogema_toolbox::views::{Format, Gallery, ImageFormat, ShownView, View};
use pogema_toolbox::{Node, Results};

use crate::output::{print_line, tell};
use crate::words::word;

#[derive(Args, Debug)]
pub struct Views {
    /// Folders of results, shown together
    #[arg(required = true, value_name = "FOLDER")]
    folders: Vec<PathBuf>,
    /// YAML file with `results_views` [default: the file stored with the results]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Show only the view of this name; may be given several times [default: all views]
    #[arg(long = "view", value_name = "NAME")]
    names: Vec<String>,
    /// Format of tables [default: as each view sets it]
    #[arg(long, value_parser = word::<Format>())]
    format: Option<Format>,
    /// Format of plots [default: as each view sets it]
    #[arg(long, value_parser = word::<ImageFormat>(), value_name = "FORMAT")]
    plots: Option<ImageFormat>,
    /// Folder for plots [default: `views` in the first folder]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Show the six metrics by this definition instead of views; with `--config` or `--view`, set the definition that
    /// those views use
    #[arg(long, value_parser = word::<Definition>(), value_name = "DEFINITION")]
    six: Option<Definition>,
}

impl Views {
    /// Shows the requested views; exit status 2 if one of them cannot be shown.
    pub fn run(&self) -> Result<ExitCode, Error> {
        let gallery = self.gallery()?;
        let results = Results::read(&self.folders)?;
        for note in &results.notes {
            tell(&format!("note: {note}"));
        }
        let mut status = ExitCode::SUCCESS;
        let mut gap = "";
        for (name, view) in &gallery.views {
            match gallery.show(name, view, &results) {
                Ok(shown) => {
                    print_view(&shown, gap)?;
                    if !shown.tables.is_empty() {
                        gap = "\n";
                    }
                }
                Err(error) => {
                    tell(&format!("error: {error}"));
                    status = ExitCode::from(2);
                }
            }
        }
        Ok(status)
    }

    /// Returns the requested views.
    fn gallery(&self) -> Result<Gallery, Error> {
        let gallery = if self.six.is_some() && self.config.is_none() && self.names.is_empty() {
            let star = View::read("six", &Node::parse("type: radar")?)?;
            Gallery { views: vec![("six".to_owned(), star)], ..Gallery::default() }
        } else {
            Gallery::of(&self.folders, self.config.as_deref(), &self.names)?
        };
        Ok(Gallery {
            format: self.format,
            kind: self.plots,
            definition: self.six,
            folder: Some(self.out.clone().unwrap_or_else(|| self.folders[0].join("views"))),
            ..gallery
        })
    }
}

/// Prints the tables of a view, the files that were written, and the notes.
fn print_view(shown: &ShownView, gap: &str) -> Result<(), Error> {
    for table in &shown.tables {
        print_line(&format!("{gap}{table}"))?;
    }
    for path in &shown.files {
        tell(&format!("wrote {}", path.display()));
    }
    for note in &shown.notes {
        tell(&format!("note: {note}"));
    }
    Ok(())
}
