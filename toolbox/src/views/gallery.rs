//! Shows all views of results: tables as text, plots as files.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use pogema_core::Error;
use pogema_core::files::write_whole;
use pogema_maps::did_you_mean;

use super::{Format, ImageFormat, View, read_views};
use crate::results::Results;
use crate::six::Definition;
use crate::store::SUITE;

/// Views by name, and options for all of them.
#[derive(Clone, Debug, Default)]
pub struct Gallery {
    /// The views.
    pub views: Vec<(String, View)>,
    /// The format of tables; overrides that of the views.
    pub format: Option<Format>,
    /// The format of plots; overrides that of the views.
    pub kind: Option<ImageFormat>,
    /// The definition of the six metrics; overrides that of the views.
    pub definition: Option<Definition>,
    /// The names of the plots' files without their endings, by view [default: made from the view's name].
    pub files: BTreeMap<String, String>,
    /// The folder for plots; if `None`, no plots are written.
    pub folder: Option<PathBuf>,
}

/// The tables of a view as text, and the files of its plots.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ShownView {
    /// Its tables, each below the view's name. CSV and TSV leave out the name.
    pub tables: Vec<String>,
    /// The files of its plots.
    pub files: Vec<PathBuf>,
    /// Notes on omitted or suspicious data, one line each.
    pub notes: Vec<String>,
}

impl Gallery {
    /// Reads the views of a file [default: the file in the folder of results]; if names are given, only those.
    ///
    /// # Errors
    /// If there is no such file or name, or the file is invalid.
    pub fn of(folders: &[PathBuf], config: Option<&Path>, names: &[String]) -> Result<Self, Error> {
        let path = config.map_or_else(|| own_config(folders), |path| Ok(path.to_owned()))?;
        let views = read_views(&path)?;
        let known = || views.iter().map(|(name, _)| name.as_str());
        if let Some(name) = names.iter().find(|&name| !known().any(|known| known == name)) {
            return Err(Error::io(&path, format!("no view `{name}`{}", did_you_mean(name, known()))));
        }
        // All views get file names, so that a plot has the same file whether or not the others are shown.
        let files = distinct_files(known().map(file_name), &[]);
        let files = known().map(str::to_owned).zip(files).collect();
        let is_chosen = |name: &String| names.is_empty() || names.contains(name);
        let views = views.into_iter().filter(|(name, _)| is_chosen(name)).collect();
        Ok(Self { views, files, ..Self::default() })
    }

    /// Shows one of the views and writes its plots.
    ///
    /// # Errors
    /// If the view cannot be shown, or a file cannot be written.
    pub fn show(&self, name: &str, view: &View, results: &Results) -> Result<ShownView, Error> {
        let shown = view.show(name, results, self.definition)?;
        let format = self.format.or(view.format()).unwrap_or(Format::Terminal);
        let tables =
            shown.tables.iter().map(|table| format!("{}{}", heading(name, format), table.text(format)));
        let mut all = ShownView { tables: tables.collect(), files: Vec::new(), notes: shown.notes };
        if let Some(folder) = &self.folder {
            for picture in &shown.pictures {
                let kind = self.kind.unwrap_or(picture.kind);
                let file = self.files.get(name).cloned().unwrap_or_else(|| file_name(name));
                all.files.push(write(folder, &file, kind, &picture.bytes(kind)?)?);
            }
        }
        Ok(all)
    }
}

fn heading(name: &str, format: Format) -> String {
    match format {
        Format::Terminal => format!("{name}\n"),
        Format::Markdown => format!("**{name}**\n\n"),
        Format::Latex => format!("% {name}\n"),
        Format::Csv | Format::Tsv => String::new(),
    }
}

/// Returns the YAML file of the first folder that has one.
fn own_config(folders: &[PathBuf]) -> Result<PathBuf, Error> {
    let named = |folder: &PathBuf| {
        let whole = folder.canonicalize().unwrap_or_else(|_| folder.clone());
        let name = whole.file_name().unwrap_or_default().to_string_lossy().into_owned();
        [folder.join(SUITE), folder.join(format!("{name}.yaml"))]
    };
    let all: Vec<PathBuf> = folders.iter().flat_map(named).collect();
    let found = all.iter().find(|path| path.is_file()).cloned();
    found.ok_or_else(|| {
        let looked = all.iter().map(|path| format!("`{}`", path.display())).collect::<Vec<_>>().join(", ");
        Error::request(format!("no views: expected {looked}, or another file as `config`"))
    })
}

fn write(folder: &Path, file: &str, kind: ImageFormat, bytes: &[u8]) -> Result<PathBuf, Error> {
    std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, error))?;
    let path = folder.join(format!("{file}.{kind}"));
    write_whole(&path, bytes)?;
    Ok(path)
}

/// Returns a view's name with `_` for characters that are unsafe in a file name.
fn file_name(name: &str) -> String {
    let is_plain = |letter: char| letter.is_alphanumeric() || "-_. ".contains(letter);
    let plain: String = name.chars().map(|letter| if is_plain(letter) { letter } else { '_' }).collect();
    let plain = plain.trim_start_matches('.');
    if plain.is_empty() { "view".to_owned() } else { plain.to_owned() }
}

/// Returns distinct names of files without endings: a name that equals an earlier or a taken one, ignoring case, gets
/// a number.
pub fn distinct_files(names: impl IntoIterator<Item = String>, taken: &[&str]) -> Vec<String> {
    let mut taken: BTreeSet<String> = taken.iter().map(|name| name.to_lowercase()).collect();
    let distinct = |name: String| {
        let numbered = (2..).map(|number| format!("{name}-{number}"));
        let mut all = std::iter::once(name.clone()).chain(numbered);
        all.find(|file| taken.insert(file.to_lowercase())).unwrap_or(name)
    };
    names.into_iter().map(distinct).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_views_share_a_file() {
        let names = ["a/b", "a_b", "A_b", "...", "a_b-2"].map(file_name);
        assert_eq!(distinct_files(names, &["View"]), ["a_b", "a_b-2", "A_b-3", "view-2", "a_b-2-2"]);
    }
}
