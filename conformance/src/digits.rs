//! Windows as hexadecimal digits.

/// Eight cells to a byte, the first one in its highest bit, as hexadecimal digits.
pub(crate) fn pack(window: &[f32]) -> String {
    in_digits(window, |&value| value != 0.0)
}

/// The same of flags.
pub(crate) fn pack_bits(bits: &[bool]) -> String {
    in_digits(bits, |&bit| bit)
}

fn in_digits<T>(cells: &[T], is_set: impl Fn(&T) -> bool) -> String {
    const DIGITS: [char; 16] =
        ['0', '1', '2', '3', '4', '5', '6', '7', '8', '9', 'a', 'b', 'c', 'd', 'e', 'f'];
    let mut text = String::with_capacity(2 * cells.len().div_ceil(8));
    for cells in cells.chunks(8) {
        let bit = |byte: u8, (at, cell)| byte | u8::from(is_set(cell)) << (7 - at);
        let byte = cells.iter().enumerate().fold(0u8, bit);
        text.push(DIGITS[usize::from(byte >> 4)]);
        text.push(DIGITS[usize::from(byte & 15)]);
    }
    text
}

/// What [`pack`] packed, and the zeros that filled the last byte.
pub(crate) fn unpack(window: &str) -> Vec<bool> {
    let digit = |character: char| character.to_digit(16).unwrap_or(0);
    window
        .chars()
        .flat_map(|character| (0..4).rev().map(move |bit| digit(character) >> bit & 1 == 1))
        .collect()
}
