//! Calls of a generator as data, so that NumPy and this crate can make the same calls.

use pogema_numpy::{Generator, SeedSequence};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// The initial state of a generator, its calls in order, and NumPy's answers.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Run {
    pub start: Start,
    pub calls: Vec<Call>,
    #[serde(default)]
    pub answers: Vec<Value>,
}

/// The initial state of a generator.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Start {
    /// A seed in 32-bit words, least significant word first.
    Words(Vec<u32>),
    /// PCG64's initial state and its stream, in decimal.
    Pcg(String, String),
}

/// One call. Shuffles apply to a list, to an array, or to the rows of an array.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(tag = "call", rename_all = "snake_case", deny_unknown_fields)]
pub enum Call {
    NextU32,
    NextU64,
    Random,
    Uniform { lo: Bits, hi: Bits },
    Integers { lo: i64, hi: i64 },
    IntegersArray { lo: i64, hi: i64, n: usize },
    ChoiceIndex { n: usize },
    ChoiceWeighted { weights: Vec<Bits> },
    ShuffleList { n: usize },
    ShuffleArray { n: usize },
    ShuffleRows { n: usize },
    Binomial1 { p: Bits },
    Binomial1Array { p: Bits, n: usize },
}

/// A double, written as the 16 hexadecimal digits of its bits.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(try_from = "String", into = "String")]
pub struct Bits(pub f64);

impl TryFrom<String> for Bits {
    type Error = std::num::ParseIntError;

    fn try_from(digits: String) -> Result<Self, Self::Error> {
        u64::from_str_radix(&digits, 16).map(|bits| Self(f64::from_bits(bits)))
    }
}

impl From<Bits> for String {
    fn from(bits: Bits) -> Self {
        format!("{:016x}", bits.0.to_bits())
    }
}

impl Run {
    /// Fails at the first call whose answer differs from NumPy's.
    pub fn replay(&self, name: &str) {
        assert_eq!(self.calls.len(), self.answers.len(), "{name}: one answer for each call");
        let mut generator = self.start.generator();
        for (index, (call, theirs)) in self.calls.iter().zip(&self.answers).enumerate() {
            let ours = call.make(&mut generator);
            assert_eq!(ours, *theirs, "{name}: {:?}, call {index}, {call:?}: ours, then NumPy's", self.start);
        }
    }
}

impl Start {
    fn generator(&self) -> Generator {
        match self {
            Self::Words(words) => Generator::from_sequence(&SeedSequence::from_words(words)),
            Self::Pcg(initial, stream) => {
                Generator::from_pcg64(Pcg64::new(initial.parse().unwrap(), stream.parse().unwrap()))
            }
        }
    }
}

impl Call {
    /// Returns the answer, or null if the call is rejected.
    fn make(&self, generator: &mut Generator) -> Value {
        match self {
            Self::NextU32 => json!(generator.next_u32()),
            Self::NextU64 => json!(generator.next_u64()),
            Self::Random => json!(Bits(generator.random())),
            Self::Uniform { lo, hi } => json!(generator.uniform(lo.0, hi.0).ok().map(Bits)),
            Self::Integers { lo, hi } => json!(generator.integers(*lo, *hi).ok()),
            Self::IntegersArray { lo, hi, n } => json!(generator.integers_array(*lo, *hi, *n).ok()),
            Self::ChoiceIndex { n } => json!(generator.choice_index(*n).ok()),
            Self::ChoiceWeighted { weights } => {
                let weights: Vec<f64> = weights.iter().map(|weight| weight.0).collect();
                json!(generator.choice_weighted(&weights).ok())
            }
            Self::ShuffleList { n } | Self::ShuffleArray { n } | Self::ShuffleRows { n } => {
                let mut items: Vec<usize> = (0..*n).collect();
                generator.shuffle(&mut items);
                json!(items)
            }
            Self::Binomial1 { p } => json!(generator.binomial1(p.0).ok()),
            Self::Binomial1Array { p, n } => {
                let mut outcomes = String::new();
                let put = |success| outcomes.push(if success { '1' } else { '0' });
                json!(generator.binomial1_array(p.0, *n, put).ok().map(|()| outcomes))
            }
        }
    }
}
