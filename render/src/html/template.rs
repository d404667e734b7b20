//! Templates with escaped values.

use minijinja::syntax::SyntaxConfig;
use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment, UndefinedBehavior};
use pogema_core::Error;
use serde::Serialize;

/// Fills in a Jinja template of HTML or SVG, with all values escaped.
///
/// # Errors
/// If the template is invalid or names a missing value.
pub fn fill(template: &str, values: impl Serialize) -> Result<String, Error> {
    let fill = || {
        let mut environment = Environment::new();
        environment.set_auto_escape_callback(|_| AutoEscape::Html);
        // A misspelt key is an error, not an empty string.
        environment.set_undefined_behavior(UndefinedBehavior::Strict);
        environment.set_syntax(SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build()?);
        environment.render_str(template, Serde(values))
    };
    let text = fill().map_err(|error: minijinja::Error| Error::external("template", error))?;
    // The library also escapes slashes, without need. Undo it, so that names can be found in the file.
    Ok(text.replace("&#x2f;", "/"))
}
