//! The forms in which a report on ports is written to files, and what they leave out as known.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use clap::Args;
use pogema_conformance::files;
use pogema_conformance::port::PortReport;
use pogema_core::Error;

use super::known::{Known, Leftover};
use super::{badge, html, junit};
use crate::output::check_writable;

#[derive(Args, Debug)]
pub struct Outputs {
    /// Write the report to this file as JUnit XML: a suite for each port, a test case for each rule
    #[arg(long, value_name = "FILE", requires = "commands")]
    junit: Option<PathBuf>,
    /// Write the report to this file as a page that needs no other file
    #[arg(long, value_name = "FILE", requires = "commands")]
    html: Option<PathBuf>,
    /// Write the verdict to this file as a small SVG picture; for one port
    #[arg(long, value_name = "FILE", requires = "commands")]
    badge: Option<PathBuf>,
    /// Bear the deviations that this file lists
    ///
    /// The file is a YAML list of entries `{rule: collide/soft, what: cell, since: 2026-11-22, reason: why}`, with
    /// `port: name` for one port alone. `rule` and `what` are those of the report's line `FAIL collide/soft: cell
    /// differs`; for a line `ERROR what` the rule is `protocol`. Causes so listed are reported apart and do not
    /// change the exit status. An entry that no port shows any more makes it 1, so that the list does not outlive
    /// its reasons: but only if its rule was compared in this run, thus never under `--case` or `--part`, nor where `--rules` or
    /// `--profile` or the port's claims leave the rule out, nor where a port broke the protocol too often to be
    /// asked everything; entries of the rule `protocol` only under neither `--rules` nor `--profile`.
    #[arg(long, value_name = "FILE", requires = "commands")]
    known: Option<PathBuf>,
}

impl Outputs {
    /// Passes if everything can be written in the end; gives what is known.
    ///
    /// # Errors
    /// With the first file or combination that cannot be.
    pub fn check(&self, num_ports: usize, json: Option<&Path>) -> Result<Known, Error> {
        if self.badge.is_some() && num_ports != 1 {
            return Err(Error::request("`--badge` needs exactly one port"));
        }
        let mut taken = BTreeSet::new();
        for path in self.paths().chain(json) {
            check_writable(path)?;
            // `x` and `./x` are one file.
            let place = std::path::absolute(path).map_err(|error| Error::io(path, error))?;
            if !taken.insert(place) {
                return Err(Error::io(path, "is to hold two reports"));
            }
        }
        self.known.as_deref().map_or_else(|| Ok(Known::default()), Known::read)
    }

    fn paths(&self) -> impl Iterator<Item = &Path> {
        [&self.junit, &self.html, &self.badge].into_iter().flatten().map(PathBuf::as_path)
    }

    /// Writes what is asked for.
    ///
    /// # Errors
    /// With the first file that cannot be written.
    pub fn write(&self, reports: &[PortReport], leftover: &Leftover) -> Result<(), Error> {
        write(self.junit.as_deref(), || junit::xml(reports, leftover))?;
        write(self.html.as_deref(), || html::page(reports, leftover))?;
        reports.first().map_or(Ok(()), |report| write(self.badge.as_deref(), || badge::badge(report)))
    }
}

fn write<E: ToString>(path: Option<&Path>, text: impl FnOnce() -> Result<String, E>) -> Result<(), Error> {
    let Some(path) = path else { return Ok(()) };
    let text = text().map_err(|error| Error::io(path, error.to_string()))?;
    files::write(path, text.as_bytes())
}
