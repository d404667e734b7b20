//! Text from templates in which everything is escaped.

use minijinja::syntax::SyntaxConfig;
use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment, UndefinedBehavior};
use pogema_core::Error;
use serde::Serialize;

/// Fills in a template of HTML or SVG, in the language of Jinja.
///
/// # Errors
/// If the template is wrong, or names what is not there.
pub fn fill(template: &str, holes: impl Serialize) -> Result<String, Error> {
    let fill = || {
        let mut environment = Environment::new();
        environment.set_auto_escape_callback(|_| AutoEscape::Html);
        // A key that is misspelt is an error, not nothing.
        environment.set_undefined_behavior(UndefinedBehavior::Strict);
        environment.set_syntax(SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build()?);
        environment.render_str(template, Serde(holes))
    };
    let text = fill().map_err(|error: minijinja::Error| Error::external("page", error))?;
    // Slashes are escaped too, without need; a reader of the file wants to find a name as it is.
    Ok(text.replace("&#x2f;", "/"))
}
