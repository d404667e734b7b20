//! The verdict as a badge for a README: as SVG, or as JSON for shields.io.

use pogema_conformance::port::PortReport;
use pogema_core::Error;
use serde_json::{Value, json};

use super::summary::{Verdict, fill, name_of, score};

/// The left part of a badge.
const LABEL: &str = "POGEMA 1.4.0";

/// Returns the right part of the badge of a port, and its colour.
fn message(report: &PortReport) -> (String, &'static str) {
    let score = score(report);
    let (word, colour) = match score.verdict() {
        Verdict::Conforms => ("conforms", "#2a7d33"),
        Verdict::Known => ("known deviations", "#6b6f00"),
        Verdict::Diverges => ("diverges", "#c01f2e"),
        Verdict::Misbehaves => ("misbehaves", "#b35900"),
        Verdict::Unchecked if score.is_interrupted => ("interrupted", "#6a6a6a"),
        Verdict::Unchecked => ("nothing checked", "#6a6a6a"),
    };
    (format!("{word} {}/{} rules", score.passed, score.played), colour)
}

/// Returns the badge of a port in the form that shields.io reads from a URL.
pub fn endpoint(report: &PortReport) -> Value {
    let (message, colour) = message(report);
    json!({"schemaVersion": 1, "label": LABEL, "message": message, "color": colour})
}

/// Returns the badge of a port as SVG.
pub fn badge(report: &PortReport) -> Result<String, Error> {
    let (message, colour) = message(report);
    let (left, right) = (width(LABEL), width(&message));
    let values = json!({
        "label": LABEL,
        "message": message,
        "port": name_of(report),
        "colour": colour,
        "left": left,
        "right": right,
    });
    fill(include_str!("badge.svg"), values)
}

/// Returns the width of a text with padding. Units: pixels.
fn width(text: &str) -> usize {
    // Verdana is the widest of the badge's fonts: at a font size of 11 pixels, a letter is about 7 pixels wide.
    7 * text.chars().count() + 10
}
