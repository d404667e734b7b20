//! Flags whose values are words.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use pogema_core::{Word, Words};

/// Parses a flag whose values are all words of an enum.
pub fn word<T: Words>() -> impl TypedValueParser<Value = T> {
    word_of(T::WORDS)
}

/// Parses a flag whose values are some words of an enum.
pub fn word_of<T: Words>(words: &'static [Word<T>]) -> impl TypedValueParser<Value = T> {
    let values = words.iter().map(|known| PossibleValue::new(known.word).help(known.help()));
    PossibleValuesParser::new(values).try_map(|word| T::read("value", &word))
}
