//! Compares tables of invalid inputs with their one-line errors.

use pogema_core::Error;

/// Asserts that each input of the table gives the error next to it.
pub fn check(table: &[(&str, &str)], error_of: &dyn Fn(&str) -> Option<Error>) {
    let mut wrong = Vec::new();
    for (text, expected) in table {
        let found = error_of(text).map_or_else(|| "no error".to_owned(), |error| error.to_string());
        if found != *expected {
            wrong.push(format!("{text}\n  gives    {found}\n  expected {expected}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
