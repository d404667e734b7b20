//! A writer for packed bits.

/// A writer that packs bits into words, from the lowest bit of the first word on.
#[derive(Debug)]
pub struct BitWriter<'a> {
    words: &'a mut [u64],
    index: usize,
    /// The bits of the word at `index` so far.
    word: u64,
    num_bits: u32,
}

impl<'a> BitWriter<'a> {
    /// Creates a writer that leaves the first `lead` bits at 0. `lead` is below 64.
    pub fn new(words: &'a mut [u64], lead: usize) -> Self {
        Self { words, index: 0, word: 0, num_bits: lead as u32 }
    }

    /// Writes the low `number` bits of a value; `number` is 1 to 64. The other bits of the value must be 0.
    pub fn push(&mut self, bits: u64, number: u32) {
        self.word |= bits << self.num_bits;
        self.num_bits += number;
        if self.num_bits >= 64 {
            self.words[self.index] = self.word;
            self.index += 1;
            self.num_bits -= 64;
            // The shift is 64 if the value fills a whole word; no bits are then left over.
            self.word = bits.checked_shr(number - self.num_bits).unwrap_or(0);
        }
    }

    /// Writes `number` bits, all 0 except the one at `index`.
    pub fn push_one_of(&mut self, index: usize, number: usize) {
        for first in (0..number).step_by(64) {
            let bits = if (first..first + 64).contains(&index) { 1 << (index - first) } else { 0 };
            self.push(bits, (number - first).min(64) as u32);
        }
    }

    /// Continues with the next word, unless the current word is empty.
    pub fn end_word(&mut self) {
        if self.num_bits > 0 {
            self.words[self.index] = self.word;
            self.index += 1;
            (self.word, self.num_bits) = (0, 0);
        }
    }
}
