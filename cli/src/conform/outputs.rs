//! The output files of a run on ports, and the list of known deviations.

use std::path::{Path, PathBuf};

use clap::Args;
use pogema_conformance::files;
use pogema_conformance::port::PortReport;
use pogema_core::Error;
use pogema_core::files::folder_of;

use super::known::{Known, Leftover};
use super::{badge, html, junit, site};
use crate::output::{check_files, is_same_folder};

#[derive(Args, Debug)]
pub struct Outputs {
    /// Write the report to this file as JUnit XML: a suite for each port, a test case for each rule
    #[arg(long, value_name = "FILE", requires = "commands")]
    junit: Option<PathBuf>,
    /// Write the report to this file as a self-contained HTML page
    #[arg(long, value_name = "FILE", requires = "commands")]
    html: Option<PathBuf>,
    /// Write the verdict to this file as an SVG badge; requires exactly one port
    #[arg(long, value_name = "FILE", requires = "commands")]
    badge: Option<PathBuf>,
    /// Write a site to this folder: a table of rules and ports, a page and badges for each port, and a Markdown version
    #[arg(long, value_name = "FOLDER", requires = "commands")]
    site: Option<PathBuf>,
    /// Accept the known deviations listed in this file
    ///
    /// The file is a YAML list of entries `{rule: collide/soft, what: cell, since: 2026-11-22, reason: why}`; add
    /// `port: name` to limit an entry to one port. Copy `rule` and `what` from the line `FAIL collide/soft: cell
    /// differs` of the report; for a line `ERROR what` the rule is `protocol`. If the report shows several causes of
    /// one rule and field, give each its own entry, with `when` copied from the report. Listed causes are reported
    /// separately and do not change the exit status. If the deviation of an entry no longer occurs in any port, the
    /// exit status is 1, so that the list stays up to date. Only entries whose rule was compared are checked in this
    /// way. An entry with `when` counts as occurring if any cause of its rule and field occurs. No entry is checked
    /// with `--case` or `--part`, or if Ctrl-C cuts the run short. An entry is not checked if protocol errors cut the
    /// run of one of its ports short. Entries for rules that `--rules`, `--profile` or the port's claims leave out are
    /// not checked. Entries for the rule `protocol` are checked only without `--rules` and `--profile`.
    #[arg(long, value_name = "FILE", requires = "commands")]
    known: Option<PathBuf>,
}

impl Outputs {
    /// Checks that all files can be written, creates the folder of the site, and reads the known deviations.
    ///
    /// # Errors
    /// For the first file that cannot be written or read, is also an input or another output, or is in the folder of
    /// the site; for a folder of the site that cannot be created; and for `--badge` with several ports.
    pub fn check(&self, num_ports: usize, cases: &[PathBuf], json: Option<&Path>) -> Result<Known, Error> {
        if self.badge.is_some() && num_ports != 1 {
            return Err(Error::request("`--badge` needs exactly one port"));
        }
        let named = [("--junit", &self.junit), ("--html", &self.html), ("--badge", &self.badge)];
        let named = named.into_iter().filter_map(|(flag, path)| Some((flag, path.as_deref()?)));
        let named: Vec<(&str, &Path)> = named.chain(json.map(|path| ("--json", path))).collect();
        let known = self.known.as_deref().map_or_else(|| Ok(Known::default()), Known::read)?;
        if let Some(site) = &self.site {
            site::create(site)?;
            let in_site = named.iter().find(|(_, path)| is_same_folder(folder_of(path), site));
            if let Some((flag, path)) = in_site {
                let reason = format!("`{flag}` is in the folder of `--site`, expected another folder");
                return Err(Error::io(path, reason));
            }
        }
        let inputs: Vec<&Path> = self.known.iter().chain(cases).map(PathBuf::as_path).collect();
        check_files(&inputs, named)?;
        Ok(known)
    }

    /// Writes the requested reports.
    ///
    /// # Errors
    /// For the first file that cannot be written.
    pub fn write(&self, reports: &[PortReport], leftover: &Leftover) -> Result<(), Error> {
        write(self.junit.as_deref(), || junit::xml(reports, leftover))?;
        write(self.html.as_deref(), || html::page(reports, leftover))?;
        self.site.as_deref().map_or(Ok(()), |folder| site::write(folder, reports, leftover))?;
        reports.first().map_or(Ok(()), |report| write(self.badge.as_deref(), || badge::badge(report)))
    }
}

fn write<E: ToString>(path: Option<&Path>, text: impl FnOnce() -> Result<String, E>) -> Result<(), Error> {
    let Some(path) = path else { return Ok(()) };
    let text = text().map_err(|error| Error::io(path, error.to_string()))?;
    files::write(path, text.as_bytes())
}
