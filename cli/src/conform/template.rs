//! Text from templates in which everything is escaped.

use minijinja::syntax::SyntaxConfig;
use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment, Error, UndefinedBehavior};
use serde::Serialize;

use super::summary::printable;

/// Fills in a template of HTML or SVG.
pub fn fill(template: &str, holes: impl Serialize) -> Result<String, Error> {
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    // A key that is misspelt is an error, not nothing.
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.set_syntax(SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build()?);
    let text = environment.render_str(template, Serde(holes))?;
    // Slashes are escaped too, without need; a reader of the file wants to find a rule by its name.
    Ok(printable(&text.replace("&#x2f;", "/")))
}
