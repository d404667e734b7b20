//! The verdict as a small picture for a README.

use pogema_conformance::port::PortReport;
use pogema_core::Error;
use serde_json::json;

use super::summary::{Verdict, fill, name_of, score};

/// The badge of a port, as SVG.
pub fn badge(report: &PortReport) -> Result<String, Error> {
    let score = score(report);
    let (word, colour) = match score.verdict() {
        Verdict::Conforms => ("conforms", "#2a7d33"),
        Verdict::Known => ("known deviations", "#6b6f00"),
        Verdict::Diverges => ("diverges", "#c01f2e"),
        Verdict::Misbehaves => ("misbehaves", "#b35900"),
        Verdict::Unchecked => ("nothing checked", "#6a6a6a"),
    };
    let (label, message) = ("POGEMA 1.4.0", format!("{word} {}/{} rules", score.passed, score.claimed));
    let (left, right) = (width(label), width(&message));
    let holes = json!({
        "label": label,
        "message": message,
        "port": name_of(report),
        "colour": colour,
        "left": left,
        "right": right,
    });
    fill(include_str!("badge.svg"), holes)
}

/// The room that a text needs, with some around it. Units: pixels.
fn width(text: &str) -> usize {
    // Of the fonts that the badge asks for, Verdana is the widest: 11 pixels high, it takes 7 for a letter.
    7 * text.chars().count() + 10
}
