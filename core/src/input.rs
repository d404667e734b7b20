//! Bounded input: no file, device or archive can fill the memory.

use std::io::{BufRead, Error, ErrorKind, Read, Result};

/// The maximum amount of input that a reader accepts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InputLimit {
    longest_line: u64,
}

impl Default for InputLimit {
    /// 256 MiB for a line.
    fn default() -> Self {
        Self::of_mib(256)
    }
}

impl InputLimit {
    /// The maximum size of a whole file, as a multiple of the longest line.
    const LINES: u64 = 4;

    /// Creates a limit from the length of the longest line. Units: MiB.
    pub fn of_mib(longest_line: u64) -> Self {
        Self { longest_line: longest_line.saturating_mul(1 << 20) }
    }

    /// Returns the size of the largest whole file, decompressed: four times the longest line. Units: bytes.
    pub fn largest_file(self) -> u64 {
        self.longest_line.saturating_mul(Self::LINES)
    }

    /// Returns a reader that fails at a line or a file that exceeds the limit.
    pub fn file<R: BufRead>(self, input: R) -> Bounded<R> {
        Bounded { input, limit: self, in_line: 0, in_all: Some(0) }
    }

    /// Returns a reader that fails at a line that exceeds the limit, and does not limit the whole input.
    pub fn lines<R: BufRead>(self, input: R) -> Bounded<R> {
        Bounded { input, limit: self, in_line: 0, in_all: None }
    }

    /// Returns the error for a file that exceeds the limit.
    pub fn file_error(self) -> Error {
        let (all, line) = (self.largest_file() >> 20, self.longest_line >> 20);
        let reason = format!(
            "the input is larger than {all} MiB, {} times the input limit of {line} MiB",
            Self::LINES
        );
        Error::new(ErrorKind::InvalidData, reason)
    }

    fn line_error(self) -> Error {
        let line = self.longest_line >> 20;
        Error::new(ErrorKind::InvalidData, format!("the line is longer than the input limit of {line} MiB"))
    }
}

/// A reader that fails instead of exceeding an [`InputLimit`].
#[derive(Debug)]
pub struct Bounded<R> {
    input: R,
    limit: InputLimit,
    /// Number of consumed bytes of the current line.
    in_line: u64,
    /// Number of consumed bytes of the whole input, if its size is limited.
    in_all: Option<u64>,
}

impl<R: BufRead> BufRead for Bounded<R> {
    fn fill_buf(&mut self) -> Result<&[u8]> {
        let limit = self.limit;
        let bytes = self.input.fill_buf()?;
        if bytes.is_empty() {
            // The last line may lack the line feed for which there was room.
            return if self.in_line > limit.longest_line { Err(limit.line_error()) } else { Ok(bytes) };
        }
        // One byte more than the longest line, for its line feed.
        let room_in_line = limit.longest_line.saturating_add(1).saturating_sub(self.in_line);
        let room_in_all = self.in_all.map_or(u64::MAX, |in_all| limit.largest_file().saturating_sub(in_all));
        match room_in_line.min(room_in_all) {
            0 if room_in_all == 0 => Err(limit.file_error()),
            0 => Err(limit.line_error()),
            room => Ok(&bytes[..bytes.len().min(usize::try_from(room).unwrap_or(usize::MAX))]),
        }
    }

    fn consume(&mut self, amount: usize) {
        if amount == 0 {
            return;
        }
        // The consumed bytes are still in the buffer, so this call reads nothing.
        let bytes = self.input.fill_buf().unwrap_or_default();
        let bytes = &bytes[..amount.min(bytes.len())];
        let in_last_line = memchr::memrchr(b'\n', bytes).map(|end| bytes.len() - end - 1);
        self.in_line = in_last_line.map_or(self.in_line + amount as u64, |length| length as u64);
        self.in_all = self.in_all.map(|in_all| in_all + amount as u64);
        self.input.consume(amount);
    }
}

impl<R: BufRead> Read for Bounded<R> {
    fn read(&mut self, out: &mut [u8]) -> Result<usize> {
        let amount = self.fill_buf()?.read(out)?;
        self.consume(amount);
        Ok(amount)
    }
}

#[cfg(test)]
mod tests {
    use std::io::{BufReader, repeat};

    use super::*;

    fn limit() -> InputLimit {
        InputLimit { longest_line: 4 }
    }

    fn lines(reader: impl BufRead) -> std::result::Result<Vec<String>, String> {
        reader.lines().collect::<Result<_>>().map_err(|error| error.to_string())
    }

    #[test]
    fn only_long_lines_and_large_files_fail() {
        for size in [1, 2, 3, 64] {
            let text = |text: &'static str| BufReader::with_capacity(size, text.as_bytes());
            assert_eq!(lines(limit().file(text("abcd\nef\n\ng"))).unwrap(), ["abcd", "ef", "", "g"]);
            assert_eq!(lines(limit().lines(text("a\nabcd"))).unwrap(), ["a", "abcd"]);
            for long in ["ab\nabcdef\n", "abcde\n", "ab\nabcde"] {
                let error = lines(limit().file(text(long))).unwrap_err();
                assert_eq!(error, "the line is longer than the input limit of 0 MiB");
            }
            let error = lines(limit().file(text("a\nb\nc\nd\ne\nf\ng\nh\ni\n"))).unwrap_err();
            assert_eq!(error, "the input is larger than 0 MiB, 4 times the input limit of 0 MiB");
            assert_eq!(lines(limit().lines(text("a\nb\nc\nd\ne\nf\ng\nh\ni\n"))).unwrap().len(), 9);
        }
    }

    #[test]
    fn endless_input_ends_in_an_error() {
        let zeros = InputLimit::of_mib(1).lines(BufReader::new(repeat(0)));
        assert_eq!(lines(zeros).unwrap_err(), "the line is longer than the input limit of 1 MiB");
        let blank = InputLimit::of_mib(1).file(BufReader::new(repeat(b'\n')));
        assert!(lines(blank).unwrap_err().starts_with("the input is larger than 4 MiB"));
        let largest = InputLimit::of_mib(u64::MAX);
        assert_eq!(lines(largest.file(&b"a\nb"[..])).unwrap(), ["a", "b"]);
    }
}
