//! The report as a site: a folder of static pages that compares ports rule by rule.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use pogema_conformance::panel::{Limits, text_of_panels};
use pogema_conformance::port::{Cause, Mode, PROTOCOL_RULE, PortReport, Verdicts};
use pogema_conformance::{Request, files};
use pogema_core::{Error, one_line};
use pogema_toolbox::views::distinct_files;
use serde_json::{Value, json};

use super::badge::{badge, endpoint};
use super::html::{self, STYLE, anchor_of, link};
use super::known::Leftover;
use super::summary::{self, Standing, fill, is_rule, names, printable, score, shortened, standing, verdict};
use crate::output::write_json;

/// Limits of the pictures in the Markdown version.
const LIMITS: Limits = Limits { rows: 12, columns: 100 };

/// Creates the folder if it is missing.
///
/// # Errors
/// [`Error::Io`] if the folder cannot be created.
pub fn create(folder: &Path) -> Result<(), Error> {
    std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, error))
}

/// Writes the pages, the badges and the Markdown version to a folder.
///
/// # Errors
/// [`Error::Io`] for the first file that cannot be written.
pub fn write(folder: &Path, reports: &[PortReport], leftover: &Leftover) -> Result<(), Error> {
    let files = file_names(&names(reports));
    for (report, file) in reports.iter().zip(&files) {
        let page = html::page(std::slice::from_ref(report), &Leftover::default())?;
        write_text(folder, &format!("{file}.html"), &page)?;
        write_text(folder, &format!("{file}.svg"), &badge(report)?)?;
        write_json(&folder.join(format!("{file}.json")), &endpoint(report))?;
    }
    write_text(folder, "index.html", &index(reports, &files, leftover)?)?;
    write_text(folder, "survey.md", &printable(&survey(reports)))?;
    write_json(&folder.join("reports.json"), &reports)
}

fn write_text(folder: &Path, name: &str, text: &str) -> Result<(), Error> {
    files::write(&folder.join(name), text.as_bytes())
}

/// Maximum length of a port name in a file name; longer names are truncated. Units: bytes.
const LONGEST_NAME: usize = 100;

/// Returns distinct file names without extension, one for each port: lower-case letters, digits, `.` and `-`.
fn file_names(names: &[String]) -> Vec<String> {
    let stem = |name: &String| {
        let letters = name.to_lowercase();
        let kept = letters.split(|letter: char| !letter.is_ascii_alphanumeric() && letter != '.');
        let stem = kept.filter(|part| !part.is_empty()).collect::<Vec<_>>().join("-");
        // The letters are ASCII. File systems limit names to 255 bytes.
        let stem = stem[..stem.len().min(LONGEST_NAME)].trim_matches(['.', '-']);
        if stem.is_empty() { "port".to_owned() } else { stem.to_owned() }
    };
    distinct_files(names.iter().map(stem), &["index", "reports"])
}

fn index(reports: &[PortReport], files: &[String], leftover: &Leftover) -> Result<String, Error> {
    let port = |((report, name), file): ((&PortReport, String), &String)| {
        let version = report.hello.as_ref().map_or("", |hello| &hello.version);
        json!({
            "name": name,
            "version": version,
            "page": format!("{file}.html"),
            "badge": format!("{file}.svg"),
            "message": endpoint(report)["message"],
        })
    };
    let page = json!({
        "style": STYLE,
        "images": "'self' data: file:",
        "title": "Which implementation follows which rule",
        "ports": reports.iter().zip(names(reports)).zip(files).map(port).collect::<Vec<_>>(),
        "rows": summary::rows(reports).into_iter().map(|rule| row(reports, files, rule)).collect::<Vec<_>>(),
        "stopped": leftover.stopped,
        "not_played": leftover.not_played,
    });
    fill(concat!(include_str!("head.html"), include_str!("site.html")), page)
}

fn row(reports: &[PortReport], files: &[String], rule: &str) -> Value {
    let cell = |(report, file): (&PortReport, &String)| {
        let (mark, class) = mark(report, rule);
        let url = anchor_of(report, 0, rule, class).map(|place| format!("{file}.html{place}"));
        json!({"mark": mark, "class": class, "url": url})
    };
    json!({"rule": link(rule), "cells": reports.iter().zip(files).map(cell).collect::<Vec<_>>()})
}

/// Returns the outcome of a rule as a sign, with the number of failures if there are any, and the CSS class of the
/// sign.
fn mark(report: &PortReport, rule: &str) -> (String, &'static str) {
    let Verdicts { failed, errors, .. } = report.rules.get(rule).copied().unwrap_or_default();
    let bad = format!("✗ {}", failed + errors);
    match standing(report, rule) {
        Standing::Passed => ("✓".into(), "passed"),
        Standing::Failed => (bad, "failed"),
        Standing::Known => (bad, "known"),
        Standing::Error => (bad, "error"),
        Standing::NotClaimed => ("–".into(), "unclaimed"),
        Standing::Blank => (String::new(), "nothing"),
    }
}

/// Returns the report as Markdown: verdicts, the table of rules, and the smallest counterexample of each cause.
fn survey(reports: &[PortReport]) -> String {
    let names: Vec<String> = names(reports).iter().map(|name| one_line(name).replace('|', "\\|")).collect();
    let mut text = String::new();
    for (report, name) in reports.iter().zip(&names) {
        let score = score(report);
        let _ =
            writeln!(text, "- {name}: {} of {} rules hold; {}", score.passed, score.played, verdict(report));
    }
    let _ = writeln!(
        text,
        "\n## Rules\n\n| rule | {} |\n| --- |{}",
        names.join(" | "),
        " --- |".repeat(names.len())
    );
    for rule in summary::rows(reports).into_iter().filter(|rule| is_rule(rule)) {
        let marks: Vec<String> = reports.iter().map(|report| mark(report, rule).0).collect();
        let _ = writeln!(text, "| `{rule}` | {} |", marks.join(" | "));
    }
    let _ = writeln!(text, "\n## Smallest counterexamples");
    let mut groups: BTreeMap<_, Vec<(&str, &Cause)>> = BTreeMap::new();
    for (report, name) in reports.iter().zip(&names) {
        for cause in &report.causes {
            let key =
                (cause.rule.as_deref().unwrap_or(PROTOCOL_RULE), cause.what.as_str(), cause.when.as_str());
            groups.entry(key).or_default().push((name, cause));
        }
    }
    for ((rule, what, when), shown) in groups {
        let _ = writeln!(text, "\n{}", counterexample(rule, what, when, &shown));
    }
    text
}

fn counterexample(rule: &str, what: &str, when: &str, shown: &[(&str, &Cause)]) -> String {
    let length = |(_, cause): &&(&str, &Cause)| request_text(&cause.example.request).len();
    let Some((_, cause)) = shown.iter().min_by_key(length) else { return String::new() };
    let times: Vec<String> = shown.iter().map(|(name, cause)| format!("{name} ({}×)", cause.times)).collect();
    let given = if cause.example.mode == Mode::Instance { "an instance" } else { "a config" };
    let mut text = format!("### `{rule}`: {what}\n\nShown by {}. ", times.join(", "));
    if cause.example.op().is_none() {
        text.push_str("The port did not start.");
        return text;
    }
    let _ = write!(text, "The port was given {given}");
    let _ = writeln!(text, "{}.\n", if when.is_empty() { String::new() } else { format!("; {when}") });
    let _ = writeln!(text, "```text\n{}", request_text(&cause.example.request));
    if let Some(found) = &cause.example.divergence {
        let (expected, got) = (shortened(&found.expected), shortened(&found.got));
        let _ = writeln!(
            text,
            "\nafter operation {}, {}:\n  expected {expected}\n  got      {got}",
            found.op, found.field
        );
        text.push_str(&text_of_panels(&found.picture, LIMITS));
    }
    if let Some(fault) = &cause.example.fault {
        let _ = writeln!(text, "\n{}", fault.what);
    }
    format!("{}\n```", text.trim_end())
}

/// Formats the fields of a config, one per line, and the operations.
fn request_text(request: &Request) -> String {
    let mut text = String::new();
    for (field, value) in request.config.as_object().into_iter().flatten() {
        match value.as_str() {
            Some(rows) if rows.contains('\n') || field == "map" => {
                let rows: Vec<String> = rows.lines().map(|row| format!("  {row}")).collect();
                let _ = writeln!(text, "{field}:\n{}", rows.join("\n"));
            }
            Some(word) => drop(writeln!(text, "{field}: {word}")),
            None => drop(writeln!(text, "{field}: {value}")),
        }
    }
    let ops: Vec<String> = request.ops.iter().map(|op| json!(op).to_string()).collect();
    format!("{text}\ndo: {}", ops.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ports_get_distinct_file_names() {
        let names = ["POGEMA", "pogema", "../../x y", "…", "index", "pogema-2"].map(str::to_owned);
        let files = file_names(&names);
        assert_eq!(files, ["pogema", "pogema-2", "x-y", "port", "index-2", "pogema-2-2"]);
        assert_eq!(file_names(&["long".repeat(100)])[0].len(), LONGEST_NAME);
    }
}
