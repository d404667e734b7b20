//! The observations of agents.

use std::cell::RefCell;
use std::ops::Range;

use pogema_core::{Error, Seen, SimdPath};
use rayon::prelude::*;

use crate::Engine;
use crate::simd::{Channels, MAX_WORDS, Value, WindowSource, lead_of, pack, per_line};

/// Number of words for the bits of some agents; enough for one agent of any radius.
const NUM_WORDS: usize = 3200;
/// Number of these words that are used for small windows, so that they stay in the cache.
const FEW_WORDS: usize = 400;
/// Largest number of bytes of a buffer that is always written through the cache.
const MAX_CACHED: usize = 8 << 20;
/// Limit for a buffer of more than [`MAX_CACHED`] bytes: the total number of bytes of the buffer and of the engines
/// that write it. If the total is at most this limit and one thread writes, it writes the buffer through the cache. For
/// two and more threads, the limit is twice as large.
const CACHED_PER_THREAD: usize = 16 << 20;
/// Number of agents that one thread processes at a time.
const CHUNK: usize = 1024;

impl Engine {
    /// Writes the `default` observation of some agents as `f32` or `u8`.
    ///
    /// Shape: `[agents, 3, side, side]`; channels obstacles, agents, goal; every value 0 or 1.
    ///
    /// # Errors
    /// Before the first reset, for agents that do not exist, or for a buffer of the wrong length.
    ///
    /// Rule: observe/default
    pub fn observe_agents<V: Value>(&self, agents: Range<usize>, out: &mut [V]) -> Result<(), Error> {
        self.check_agents(&agents)?;
        let per_agent = 3 * self.config.side() * self.config.side();
        Error::check_length("observations", agents.len() * per_agent, out.len())?;
        self.write_values(agents, Channels::All, out, self.is_streamed(size_of_val(out)));
        Ok(())
    }

    /// Returns whether a buffer of this size should be written with streaming stores.
    pub(crate) fn is_streamed(&self, num_bytes: usize) -> bool {
        bypasses_cache(num_bytes, [self], self.pool.as_ref().map_or(1, |pool| pool.current_num_threads()))
    }

    /// Writes the `default` observation of all agents into a part of a larger buffer.
    pub(crate) fn observe_all<V: Value>(&self, out: &mut [V], streaming: bool) {
        self.write_values(0..self.config.num_agents, Channels::All, out, streaming);
    }

    /// Writes the `default` observation of some agents as bits.
    ///
    /// The bits of each agent begin at a new word: channel after channel, row after row, the first cell in the lowest
    /// bit.
    ///
    /// Shape: `[agents, words]` with [`words_per_agent`] words.
    ///
    /// # Errors
    /// As for [`Engine::observe_agents`].
    ///
    /// Rule: observe/default
    pub fn observe_bits(&self, agents: Range<usize>, out: &mut [u64]) -> Result<(), Error> {
        self.check_agents(&agents)?;
        let per_agent = words_per_agent(self.config.radius);
        Error::check_length("observations", agents.len() * per_agent, out.len())?;
        let source = self.window_source();
        self.in_parts(agents.start, per_agent, out, |first, out| {
            let agents = first..first + out.len() / per_agent;
            pack(self.path, &source, agents, Channels::All, (0, true), out);
        });
        Ok(())
    }

    /// Writes a buffer for the agents from `first` on. If there is a pool and the buffer holds more than [`CHUNK`]
    /// agents, the threads of the pool write the buffer in parts.
    fn in_parts<T: Send>(
        &self,
        first: usize,
        per_agent: usize,
        out: &mut [T],
        write: impl Fn(usize, &mut [T]) + Sync,
    ) {
        match self.pool.as_ref().filter(|_| out.len() > CHUNK * per_agent) {
            Some(pool) => pool.install(|| {
                let chunks = out.par_chunks_mut(CHUNK * per_agent).enumerate();
                chunks.for_each(|(chunk, out)| write(first + chunk * CHUNK, out));
            }),
            None => write(first, out),
        }
    }

    fn check_agents(&self, agents: &Range<usize>) -> Result<(), Error> {
        self.check_started()?;
        if agents.start > agents.end || agents.end > self.config.num_agents {
            let expected = format!("within 0..{}", self.config.num_agents);
            return Err(Error::argument("agents", format!("{agents:?}"), expected));
        }
        Ok(())
    }

    fn window_source(&self) -> WindowSource<'_> {
        WindowSource {
            obstacles: &self.obstacles,
            occupied: &self.occupied,
            cells: &self.cells,
            goals: &self.goals,
            radius: self.config.radius,
        }
    }

    fn write_values<V: Value>(
        &self,
        agents: Range<usize>,
        channels: Channels,
        out: &mut [V],
        streaming: bool,
    ) {
        let per_agent = channels.number() * self.config.side() * self.config.side();
        let source = self.window_source();
        self.in_parts(agents.start, per_agent, out, |first, out| {
            WORDS.with_borrow_mut(|words| {
                let few = per_agent.div_ceil(64) < FEW_WORDS / 16;
                let words = if few { &mut words[..FEW_WORDS] } else { &mut words[..] };
                write_blocks(self.path, &source, first, channels, out, streaming, words);
            });
        });
    }

    /// Writes the windows of the `POMAPF` observation of all agents into two buffers, for obstacles and agents.
    ///
    /// Shape: both `[agents, side, side]`; every value 0 or 1.
    ///
    /// # Errors
    /// Before the first reset, or for a buffer of the wrong length.
    ///
    /// Rule: observe/pomapf
    pub fn observe_windows(&self, obstacles: &mut [f32], agents: &mut [f32]) -> Result<(), Error> {
        self.check_started()?;
        let num_agents = self.config.num_agents;
        let num_values = num_agents * self.config.side() * self.config.side();
        Error::check_length("obstacles", num_values, obstacles.len())?;
        Error::check_length("agents", num_values, agents.len())?;
        self.write_windows(obstacles, agents, false);
        Ok(())
    }

    /// Writes the windows of the `POMAPF` observation of all agents into parts of larger buffers.
    pub(crate) fn write_windows<V: Value>(&self, obstacles: &mut [V], agents: &mut [V], streaming: bool) {
        let all = 0..self.config.num_agents;
        self.write_values(all.clone(), Channels::Obstacles, obstacles, streaming);
        self.write_values(all, Channels::Agents, agents, streaming);
    }

    /// Writes the map with its border.
    ///
    /// Rule: observe/mapf
    pub(crate) fn write_map(&self, out: &mut [u8]) -> Result<(), Error> {
        let border = 2 * self.config.radius;
        let (height, width) = (self.height + border, self.width + border);
        Error::check_length("global obstacles", height * width, out.len())?;
        for (row, values) in out.chunks_mut(width).enumerate() {
            self.obstacles.read_row(row, 0, values);
        }
        Ok(())
    }

    /// Counts the agents and the free cells in the window of each agent.
    ///
    /// Rule: metrics/density
    pub(crate) fn count_in_windows(&self, seen: &mut Vec<Seen>) {
        let (area, per_agent) =
            (self.config.side() * self.config.side(), words_per_agent(self.config.radius));
        let (num_agents, per_block) = (self.config.num_agents, NUM_WORDS / per_agent);
        let source = self.window_source();
        seen.clear();
        WORDS.with_borrow_mut(|words| {
            for first in (0..num_agents).step_by(per_block) {
                let agents = first..num_agents.min(first + per_block);
                let words = &mut words[..agents.len() * per_agent];
                pack(self.path, &source, agents, Channels::All, (0, true), words);
                seen.extend(words.chunks_exact(per_agent).map(|words| Seen {
                    agents: ones(words, area, 2 * area),
                    free_cells: area as u32 - ones(words, 0, area),
                }));
            }
        });
    }
}

/// Returns the number of set bits from `first` up to but not including `end`.
fn ones(words: &[u64], first: usize, end: usize) -> u32 {
    let (head, tail) = (first / 64, end / 64);
    let below = |bit: usize| (1u64 << (bit % 64)) - 1;
    let whole: u32 = words[head..tail].iter().map(|word| word.count_ones()).sum();
    let last = if end.is_multiple_of(64) { 0 } else { (words[tail] & below(end)).count_ones() };
    whole + last - (words[head] & below(first)).count_ones()
}

/// Returns whether a buffer should be written with streaming stores, which the AVX-512 path has. They bypass the cache,
/// so that the boards of the engines stay in it.
pub(crate) fn bypasses_cache<'e>(
    num_bytes: usize,
    engines: impl IntoIterator<Item = &'e Engine>,
    num_threads: usize,
) -> bool {
    // For most buffers, which are small, the bytes of the engines need not be counted.
    num_bytes > MAX_CACHED
        && num_bytes + engines.into_iter().map(Engine::num_bytes).sum::<usize>()
            > CACHED_PER_THREAD * num_threads.min(2)
}

/// Returns the number of words for the bits of one agent's `default` observation.
pub fn words_per_agent(radius: usize) -> usize {
    (3 * (2 * radius + 1) * (2 * radius + 1)).div_ceil(64)
}

thread_local! {
    /// Words that are reused in every call, so that they need not be cleared each time.
    static WORDS: RefCell<[u64; NUM_WORDS]> = const { RefCell::new([0; NUM_WORDS]) };
}

/// Writes the values of the agents from `first` on. `words` holds the bits of as many agents at a time as fit.
fn write_blocks<V: Value>(
    path: SimdPath,
    source: &WindowSource<'_>,
    first: usize,
    channels: Channels,
    out: &mut [V],
    streaming: bool,
    words: &mut [u64],
) {
    let per_agent = channels.number() * source.side() * source.side();
    // The first bits may be skipped, and the writes for an agent may touch more words than it fills.
    let room = (words.len() - MAX_WORDS) / per_agent.div_ceil(64);
    // The values of this many agents fill a whole number of cache lines.
    let whole = room - room % per_line::<V>();
    let per_block = if whole > 0 { whole } else { room };
    for (block, out) in out.chunks_mut(per_block * per_agent).enumerate() {
        let first = first + block * per_block;
        let lead = lead_of(out);
        let agents = first..first + out.len() / per_agent;
        pack(path, source, agents, channels, (lead, false), words);
        V::spread(path, words, lead, out, streaming);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ones_are_counted_within_their_bounds() {
        let words = [u64::MAX, 0b1011, u64::MAX];
        let is_set = |bit: usize| words[bit / 64] >> (bit % 64) & 1 == 1;
        for first in 0..190 {
            for end in first..=190 {
                let expected = (first..end).filter(|&bit| is_set(bit)).count();
                assert_eq!(ones(&words, first, end) as usize, expected, "{first}..{end}");
            }
        }
    }
}
