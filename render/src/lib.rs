//! Pictures of episodes.
//!
//! [`Film`] is what every picture is made from: a map, and the state after the reset and after each step.

mod film;
pub mod html;
pub mod stays;

pub use film::Film;
