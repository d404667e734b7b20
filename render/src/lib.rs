//! Pictures of episodes.
//!
//! [`Film`] is what every picture is made from: a map, and the state after the reset and after each step. A
//! [`Style`] says how it is drawn.
//!
//! | module | what it makes |
//! | --- | --- |
//! | [`svg`] | animations and pictures for browsers and papers |
//! | [`text`] | frames for the terminal |
//! | [`raster`] | one frame as PNG |
//! | [`gif`] | GIF animations |
//! | [`video`] | MP4 and `WebM`, by the program ffmpeg |
//! | [`html`] | a page that replays an episode, and one that edits maps |
//! | [`stays`] | which rule reverted which move |

mod film;
pub mod gif;
mod ground;
pub mod html;
mod motion;
pub mod raster;
mod scene;
pub mod stays;
mod style;
pub mod svg;
pub mod text;
pub mod video;

pub use film::Film;
pub use ground::{Border, Ground};
pub use motion::{MOST_FRAMES, MOST_PIXELS as MOST_FRAME_PIXELS};
pub use style::{Color, Colors, Style};
