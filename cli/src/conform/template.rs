//! Text from templates in which everything is escaped.

use pogema_core::Error;
use serde::Serialize;

use super::summary::printable;

/// Fills in a template of HTML or SVG.
pub fn fill(template: &str, holes: impl Serialize) -> Result<String, Error> {
    Ok(printable(&pogema_render::html::fill(template, holes)?))
}
