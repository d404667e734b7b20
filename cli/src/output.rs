//! What the program says on standard output.

use std::io::{ErrorKind, Write};

use pogema_core::Error;

/// Writes a line; ends the program quietly if nobody reads any more, as in `pogema conform | head`.
pub fn say(text: &str) -> Result<(), Error> {
    let mut output = std::io::stdout().lock();
    match writeln!(output, "{text}").and_then(|()| output.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => std::process::exit(0),
        result => result.map_err(|error| Error::io("standard output", error)),
    }
}
