//! Enums whose variants are words in configs, files, flags and Python.

use serde::{Deserialize, Deserializer, Serializer, de::Error as _};

use crate::Error;

/// A variant with its word and its documentation.
#[derive(Clone, Copy, Debug)]
pub struct Word<T> {
    /// The variant.
    pub value: T,
    /// The word in every file, flag and Python call.
    pub word: &'static str,
    doc: &'static str,
}

impl<T> Word<T> {
    #[doc(hidden)]
    pub const fn new(value: T, word: &'static str, doc: &'static str) -> Self {
        Self { value, word, doc }
    }

    /// Returns the first line of the variant's documentation, without its full stop.
    pub fn help(&self) -> &'static str {
        let line = self.doc.trim();
        line.strip_suffix('.').unwrap_or(line)
    }
}

/// An enum with one word for each variant, defined by [`words!`](crate::words!).
///
/// Serde, config files, flags and Python all use this table.
pub trait Words: Copy + PartialEq + Send + Sync + 'static {
    /// The variants in the order of their definition.
    const WORDS: &'static [Word<Self>];
    /// The words in the same order.
    const NAMES: &'static [&'static str];

    /// Returns all variants in the order of their definition.
    fn all() -> impl Iterator<Item = Self> {
        Self::WORDS.iter().map(|known| known.value)
    }

    /// Returns the word of this variant.
    fn word(self) -> &'static str {
        Self::WORDS.iter().find(|known| known.value == self).map_or("", |known| known.word)
    }

    /// Returns the variant of a word.
    fn of_word(word: &str) -> Option<Self> {
        Self::WORDS.iter().find(|known| known.word == word).map(|known| known.value)
    }

    /// Returns the variant of the word in an argument.
    ///
    /// # Errors
    /// [`Error::Argument`] with the argument, the word and all known words.
    fn read(argument: &str, word: &str) -> Result<Self, Error> {
        Self::of_word(word).ok_or_else(|| Error::argument(argument, word, Self::expected()))
    }

    /// Returns all words as an error message lists them.
    fn expected() -> String {
        let quoted: Vec<String> = Self::NAMES.iter().map(|word| format!("`{word}`")).collect();
        format!("one of {}", quoted.join(", "))
    }
}

/// Writes a variant as its word.
///
/// # Errors
/// If the serializer fails.
pub fn serialize_word<T: Words, S: Serializer>(value: T, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(value.word())
}

/// Reads a variant from its word.
///
/// # Errors
/// If the deserializer fails or the word is unknown.
pub fn deserialize_word<'de, T: Words, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error> {
    let word = String::deserialize(deserializer)?;
    T::of_word(&word).ok_or_else(|| D::Error::unknown_variant(&word, T::NAMES))
}

/// Defines an enum and the word of each variant.
///
/// The enum implements [`Words`], `Display`, and serde's traits.
///
/// ```
/// pogema_core::words! {
///     /// The side of the road that a car drives on.
///     #[derive(Default)]
///     pub enum Side {
///         /// Left of the centre line.
///         #[default]
///         Left = "left",
///         /// Right of the centre line.
///         Right = "right",
///     }
/// }
/// use pogema_core::Words;
/// assert_eq!(Side::of_word("right"), Some(Side::Right));
/// assert_eq!(Side::default().to_string(), "left");
/// ```
#[macro_export]
macro_rules! words {
    (
        $(#[$attribute:meta])*
        $visibility:vis enum $name:ident {
            $(
                #[doc = $help:literal]
                $(#[doc = $more:literal])*
                $(#[default $($default:tt)?])?
                $variant:ident = $word:literal
            ),+ $(,)?
        }
    ) => {
        $(#[$attribute])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        $visibility enum $name {
            $(
                #[doc = $help]
                $(#[doc = $more])*
                $(#[default $($default)?])?
                $variant,
            )+
        }

        impl $crate::Words for $name {
            const WORDS: &'static [$crate::Word<Self>] =
                &[$($crate::Word::new(Self::$variant, $word, $help)),+];
            const NAMES: &'static [&'static str] = &[$($word),+];
        }

        impl ::std::fmt::Display for $name {
            fn fmt(&self, formatter: &mut ::std::fmt::Formatter<'_>) -> ::std::fmt::Result {
                formatter.write_str($crate::Words::word(*self))
            }
        }

        impl $crate::serde::Serialize for $name {
            fn serialize<S: $crate::serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                $crate::serialize_word(*self, serializer)
            }
        }

        impl<'de> $crate::serde::Deserialize<'de> for $name {
            fn deserialize<D: $crate::serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                $crate::deserialize_word(deserializer)
            }
        }
    };
}
