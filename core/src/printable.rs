//! Escapes for text that comes from outside and is printed.

/// Returns whether a character can end a line, move the cursor or reorder the text around it.
///
/// These are the control characters, the line and paragraph separators, and the bidirectional formatting characters.
pub fn is_unprintable(letter: char) -> bool {
    let changes_direction = matches!(letter, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    letter.is_control() || changes_direction || matches!(letter, '\u{2028}' | '\u{2029}')
}

/// Escapes the unprintable characters of a text, so that quoted input can neither end the line nor move the cursor.
pub fn one_line(text: impl std::fmt::Display) -> String {
    let mut line = String::new();
    for letter in text.to_string().chars() {
        if is_unprintable(letter) { line.extend(letter.escape_debug()) } else { line.push(letter) }
    }
    line
}

/// Escapes the unprintable characters in the strings of a JSON text on one line; its value stays the same.
pub fn printable_json(text: &str) -> String {
    let mut line = String::new();
    for letter in text.chars() {
        // The code points of all unprintable characters fit in four hexadecimal digits.
        if is_unprintable(letter) {
            line.extend(format!("\\u{:04x}", letter as u32).chars());
        } else {
            line.push(letter);
        }
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unprintable_characters_are_escaped() {
        let text = "a\u{202e}b\u{61c}\u{9b}2J\u{2028}é❯💥\"";
        assert_eq!(one_line(text), "a\\u{202e}b\\u{61c}\\u{9b}2J\\u{2028}é❯💥\"");
        assert_eq!(one_line("a\n\tb\r"), "a\\n\\tb\\r");
        let json = printable_json(&serde_json::to_string(text).unwrap());
        assert_eq!(json, r#""a\u202eb\u061c\u009b2J\u2028é❯💥\"""#);
        assert_eq!(serde_json::from_str::<String>(&json).unwrap(), text);
    }
}
