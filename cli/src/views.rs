//! `pogema views`: tables and plots of results.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use pogema_core::Error;
use pogema_toolbox::six::Definition;
use pogema_toolbox::views::{Format, Gallery, ImageFormat, ShownView, View};
use pogema_toolbox::{Node, Results};

use crate::output::say;
use crate::words::word;

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
    #[arg(long, value_parser = word::<Format>())]
    format: Option<Format>,
    /// The format of plots, whatever the views say
    #[arg(long, value_parser = word::<ImageFormat>(), value_name = "FORMAT")]
    plots: Option<ImageFormat>,
    /// Where plots are written; by default `views` in the first folder
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// The six metrics by this definition, in place of views; beside `--config` or `--view`, the definition for theirs
    #[arg(long, value_parser = word::<Definition>(), value_name = "DEFINITION")]
    six: Option<Definition>,
}

impl Views {
    /// Shows all views that can be shown; exit status 2 if one could not.
    pub fn run(&self) -> Result<ExitCode, Error> {
        let gallery = self.gallery()?;
        let results = Results::read(&self.folders)?;
        for note in &results.notes {
            eprintln!("note: {note}");
        }
        let mut status = ExitCode::SUCCESS;
        for (number, (name, view)) in gallery.views.iter().enumerate() {
            match gallery.show(name, view, &results) {
                Ok(shown) => tell(&shown, if number == 0 { "" } else { "\n" })?,
                Err(error) => {
                    eprintln!("error: {error}");
                    status = ExitCode::from(2);
                }
            }
        }
        Ok(status)
    }

    /// The views that were asked for.
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

/// Prints the tables of a view, and says what was written and what left out.
fn tell(shown: &ShownView, gap: &str) -> Result<(), Error> {
    for table in &shown.tables {
        say(&format!("{gap}{table}"))?;
    }
    for path in &shown.files {
        eprintln!("wrote {}", path.display());
    }
    for note in &shown.notes {
        eprintln!("note: {note}");
    }
    Ok(())
}
