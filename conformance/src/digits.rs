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

/// Returns the `N` square windows of one size that [`pack`] packed together; `None` if the digits do not hold such
/// windows.
pub(crate) fn windows<const N: usize>(digits: &str) -> Option<[Vec<bool>; N]> {
    let flags = unpack(digits);
    let areas = (1..).step_by(2).map(|side: usize| side * side).take_while(|area| N * area <= flags.len());
    let area = areas.last().filter(|area| flags.len() < N * area + 8)?;
    Some(std::array::from_fn(|index| flags[index * area..(index + 1) * area].to_vec()))
}

/// Draws a square window, row by row, with `.` for 0 and `1` for 1.
pub(crate) fn lines(window: &[bool]) -> String {
    let side = window.len().isqrt().max(1);
    let line = |row: &[bool]| row.iter().map(|&flag| if flag { '1' } else { '.' }).collect::<String>();
    window.chunks(side).map(line).collect::<Vec<_>>().join("\n")
}
