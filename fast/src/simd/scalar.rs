//! The path without intrinsics. Tests compare the other paths with it.

use std::ops::Range;
use std::sync::atomic::Ordering::Relaxed;

use crate::bits::BitWriter;
use crate::grid::{STRIDE, Strips};

use super::{Channels, WindowSource};

/// Side of the widest window that lies in one strip.
const NARROW: usize = 64 - STRIDE + 1;

pub fn pack(
    source: &WindowSource<'_>,
    agents: Range<usize>,
    channels: Channels,
    (lead, apart): (usize, bool),
    words: &mut [u64],
) {
    let side = source.side();
    let mut writer = BitWriter::new(words, lead);
    for agent in agents {
        let cell = source.cells[agent];
        let (row, col) = (usize::from(cell.row), usize::from(cell.col));
        if channels != Channels::Agents {
            write_window(source.obstacles, row, col, side, &mut writer);
        }
        if channels != Channels::Obstacles {
            write_window(source.occupied, row, col, side, &mut writer);
        }
        if channels == Channels::All {
            writer.push_one_of(WindowSource::goal_index(cell, source.goals[agent], side), side * side);
        }
        if apart {
            writer.end_word();
        }
    }
    writer.end_word();
}

fn write_window(strips: &Strips, row: usize, col: usize, side: usize, writer: &mut BitWriter<'_>) {
    let (words, shift) = strips.window(row, col);
    if side <= NARROW {
        let mask = u64::MAX >> (64 - side);
        // As many rows at a time as fit in a word.
        for rows in words[..side].chunks(64 / side) {
            let row_bits = |word: &std::sync::atomic::AtomicU64| (word.load(Relaxed) >> shift) & mask;
            let bits = rows.iter().rev().fold(0, |bits, word| bits << side | row_bits(word));
            writer.push(bits, (rows.len() * side) as u32);
        }
        return;
    }
    for down in 0..side {
        for right in (0..side).step_by(STRIDE) {
            let width = STRIDE.min(side - right);
            let word = words[right / STRIDE * strips.num_rows() + down].load(Relaxed);
            writer.push((word >> shift) & (u64::MAX >> (64 - width)), width as u32);
        }
    }
}

/// For each byte, the values of its eight bits.
pub type Table<V> = [[V; 8]; 256];

pub static FLOATS: Table<f32> = table([0.0, 1.0]);
pub static BYTES: Table<u8> = table([0, 1]);

const fn table<V: Copy>(values: [V; 2]) -> Table<V> {
    let mut table = [[values[0]; 8]; 256];
    // A plain loop, since constant functions cannot use iterators.
    let mut index = 0;
    while index < 8 * 256 {
        table[index / 8][index % 8] = values[((index / 8) >> (index % 8)) & 1];
        index += 1;
    }
    table
}

pub fn spread<V: Copy>(words: &[u64], lead: usize, out: &mut [V], table: &Table<V>) {
    let mut bits = lead;
    for part in split_by_words(lead, out) {
        let word = words[bits / 64] >> (bits % 64);
        bits += part.len();
        let values_of = |index: usize| &table[usize::from((word >> (8 * index)) as u8)];
        let (whole, rest) = part.as_chunks_mut();
        for (index, slots) in whole.iter_mut().enumerate() {
            *slots = *values_of(index);
        }
        if !rest.is_empty() {
            rest.copy_from_slice(&values_of(whole.len())[..rest.len()]);
        }
    }
}

/// Splits the values so that the bits of each part lie in one word. The first word begins with `lead` bits that have no
/// value.
fn split_by_words<V>(lead: usize, out: &mut [V]) -> impl Iterator<Item = &mut [V]> {
    let (first, rest) = out.split_at_mut(out.len().min((64 - lead % 64) % 64));
    std::iter::once(first).chain(rest.chunks_mut(64)).filter(|part| !part.is_empty())
}
