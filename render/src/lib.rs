//! Pictures of episodes.
//!
//! [`Film`] is what every picture is made from: a map, and the state after the reset and after each step. A
//! [`Style`] says how it is drawn.
//!
//! | module | what it makes |
//! | --- | --- |
//! | [`svg`] | animations and pictures for browsers and papers |

mod film;
mod ground;
mod scene;
mod style;
pub mod svg;

pub use film::Film;
pub use ground::{Border, Ground};
pub use style::{Color, Colors, Style};
