//! Value parsers for flags that accept the words of an enum.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use pogema_core::{Word, Words};

/// Returns a parser that accepts all words of an enum.
pub fn word<T: Words>() -> impl TypedValueParser<Value = T> {
    word_of(T::WORDS)
}

/// Returns a parser that accepts some words of an enum.
pub fn word_of<T: Words>(words: &'static [Word<T>]) -> impl TypedValueParser<Value = T> {
    let values = words.iter().map(|known| PossibleValue::new(known.word).help(known.help()));
    PossibleValuesParser::new(values).try_map(|word| T::read("value", &word))
}
