//! Conversion of a seed of any size to the state of a generator.

use crate::NumpyError;

const POOL_WORDS: usize = 4;

const MIX_LEFT: u32 = 0xCA01_F9DD;
const MIX_RIGHT: u32 = 0x4973_F715;

/// A pool of mixed seed bits, from which generators derive their initial state.
///
/// POGEMA never spawns sequences. Use spawn keys to derive many independent seeds from one.
///
/// Source: NumPy 1.26, `SeedSequence`, pool of four words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SeedSequence {
    pool: [u32; POOL_WORDS],
}

impl SeedSequence {
    /// Creates the sequence of a seed that fits in 64 bits.
    pub fn from_u64(seed: u64) -> Self {
        Self::from_words(&[seed as u32, (seed >> 32) as u32])
    }

    /// Creates the sequence of a seed of any size, given in 32-bit words, least significant word first.
    ///
    /// The words are used unchanged, as NumPy uses an array of `uint32`. If there are more than four words, they
    /// represent an integer only if the last word is not zero. An empty list represents the seed 0.
    pub fn from_words(words: &[u32]) -> Self {
        let mut hash = Hash::absorbing();
        let mut pool = [0; POOL_WORDS];
        for (index, slot) in pool.iter_mut().enumerate() {
            *slot = hash.next(words.get(index).copied().unwrap_or(0));
        }
        // Every slot is mixed into every other one, so that the last words affect the first slots.
        for source in 0..POOL_WORDS {
            for target in (0..POOL_WORDS).filter(|&target| target != source) {
                pool[target] = mix(pool[target], hash.next(pool[source]));
            }
        }
        for &word in words.iter().skip(POOL_WORDS) {
            for slot in &mut pool {
                *slot = mix(*slot, hash.next(word));
            }
        }
        Self { pool }
    }

    /// Creates a child of the sequence of a seed. Equal keys lead to equal children. A child has only 128 bits.
    /// Different keys of the same length, with parts below 2^32, therefore almost always lead to different children,
    /// but collisions are possible.
    ///
    /// Source: NumPy 1.26, `SeedSequence(seed, spawn_key=key)`.
    pub fn spawned(seed: u64, key: &[u64]) -> Self {
        // The seed is padded to the size of the pool, so that the words of the key are separate from those of the seed.
        let mut words = vec![seed as u32, (seed >> 32) as u32, 0, 0];
        for &part in key {
            words.push(part as u32);
            words.extend(Some((part >> 32) as u32).filter(|&high| high != 0));
        }
        Self::from_words(&words)
    }

    /// Creates an unpredictable sequence from 128 random bits of the operating system.
    ///
    /// # Errors
    /// [`NumpyError::NoEntropy`] if the operating system supplies no entropy.
    ///
    /// Source: NumPy 1.26, `SeedSequence(None)`.
    pub fn from_os() -> Result<Self, NumpyError> {
        let mut words = [0; POOL_WORDS];
        for word in &mut words {
            *word = getrandom::u32().map_err(NumpyError::NoEntropy)?;
        }
        Ok(Self::from_words(&words))
    }

    /// Returns the mixed entropy.
    pub fn pool(&self) -> [u32; POOL_WORDS] {
        self.pool
    }

    /// Returns the first `N` words of state from the pool, the same in every call.
    ///
    /// Source: NumPy 1.26, `SeedSequence.generate_state(N, uint32)`.
    pub fn generate_state_u32<const N: usize>(&self) -> [u32; N] {
        let mut words = self.state_words();
        std::array::from_fn(|_| words())
    }

    /// Returns the state of [`SeedSequence::generate_state_u32`] in 64-bit words, each of which joins two 32-bit words,
    /// low word first.
    ///
    /// Source: NumPy 1.26, `SeedSequence.generate_state(N, uint64)`.
    pub fn generate_state_u64<const N: usize>(&self) -> [u64; N] {
        let mut words = self.state_words();
        std::array::from_fn(|_| {
            let low = u64::from(words());
            u64::from(words()) << 32 | low
        })
    }

    /// Returns an endless source of state words, which hashes the slots of the pool cyclically.
    fn state_words(&self) -> impl FnMut() -> u32 {
        let mut hash = Hash::emitting();
        let mut slots = self.pool.into_iter().cycle();
        move || hash.next(slots.next().unwrap_or(0))
    }
}

/// A hash whose key changes with every word, so that equal words hash differently.
struct Hash {
    key: u32,
    multiplier: u32,
}

impl Hash {
    /// Creates the hash for entropy that enters the pool.
    fn absorbing() -> Self {
        Self { key: 0x43B0_D7E5, multiplier: 0x931E_8875 }
    }

    /// Creates the hash for state that leaves the pool.
    fn emitting() -> Self {
        Self { key: 0x8B51_F9DD, multiplier: 0x58F3_8DED }
    }

    fn next(&mut self, word: u32) -> u32 {
        let keyed = word ^ self.key;
        self.key = self.key.wrapping_mul(self.multiplier);
        let spread = keyed.wrapping_mul(self.key);
        spread ^ spread >> 16
    }
}

fn mix(left: u32, right: u32) -> u32 {
    let mixed = MIX_LEFT.wrapping_mul(left).wrapping_sub(MIX_RIGHT.wrapping_mul(right));
    mixed ^ mixed >> 16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_list_represents_seed_zero() {
        assert_eq!(SeedSequence::from_words(&[]), SeedSequence::from_u64(0));
    }

    #[test]
    fn trailing_zero_words_matter_only_beyond_the_pool() {
        let short = SeedSequence::from_words(&[7]);
        assert_eq!(SeedSequence::from_words(&[7, 0, 0, 0]), short);
        assert_ne!(SeedSequence::from_words(&[7, 0, 0, 0, 0]), short);
    }

    #[test]
    fn children_match_numpy() {
        let state = |seed, key: &[u64]| SeedSequence::spawned(seed, key).generate_state_u64::<1>()[0];
        assert_eq!(state(0, &[0]), 8_668_861_027_912_758_289);
        assert_eq!(state(42, &[3, 1]), 12_600_661_634_385_724_904);
        assert_eq!(state((1 << 63) - 2, &[7, 1 << 40]), 3_659_487_751_733_228_297);
        assert_eq!(SeedSequence::spawned(5, &[]), SeedSequence::from_u64(5));
    }

    #[test]
    fn two_sequences_of_the_operating_system_differ() {
        assert_ne!(SeedSequence::from_os().unwrap(), SeedSequence::from_os().unwrap());
    }
}
