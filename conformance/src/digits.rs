//! Windows and bytes as strings of hexadecimal digits.

/// Writes bytes as hexadecimal digits.
pub(crate) fn digits_of(bytes: impl IntoIterator<Item = u8>) -> String {
    let digits = bytes.into_iter().flat_map(|byte| [byte >> 4, byte & 15]);
    digits.filter_map(|digit| char::from_digit(digit.into(), 16)).collect()
}

/// Packs eight cells into a byte, the first into its highest bit, and writes the bytes as hexadecimal digits.
pub(crate) fn pack<T>(window: &[T], is_set: impl Fn(&T) -> bool) -> String {
    digits_of(window.chunks(8).map(|cells| {
        cells.iter().zip((0..8).rev()).fold(0, |byte, (cell, bit)| byte | u8::from(is_set(cell)) << bit)
    }))
}

/// Returns the cells that [`pack`] packed, followed by the zeros that pad the last byte.
pub(crate) fn unpack(window: &str) -> Vec<bool> {
    let digit = |character: char| character.to_digit(16).unwrap_or(0);
    window
        .chars()
        .flat_map(|character| (0..4).rev().map(move |bit| digit(character) >> bit & 1 == 1))
        .collect()
}

/// Returns the area of a square window, given the number of flags of three windows padded to whole bytes.
pub(crate) fn area_of(num_flags: usize) -> Option<usize> {
    let areas = (1..).step_by(2).map(|side: usize| side * side).take_while(|area| 3 * area <= num_flags);
    areas.last().filter(|area| num_flags < 3 * area + 8)
}
