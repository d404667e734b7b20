//! Pictures of episodes.
//!
//! Every picture is drawn from a [`pogema_core::Trace`]; a [`Style`] says how. Frame 0 is the state after the reset, frame
//! 1 the state after the first step.
//!
//! | module | what it makes |
//! | --- | --- |
//! | [`svg`] | animations and pictures for browsers and papers |
//! | [`text`] | frames for the terminal |
//! | [`raster`] | one frame as PNG |
//! | [`gif`] | GIF animations |
//! | [`video`] | MP4 and `WebM`, by the program ffmpeg |
//! | [`html`] | a page that replays an episode, and one that edits maps |
//! | [`blocked_moves`] | which rule reverted which move |

#![forbid(unsafe_code)]

pub mod blocked_moves;
mod check;
pub mod gif;
mod ground;
pub mod html;
mod motion;
pub mod raster;
mod scene;
mod style;
pub mod svg;
pub mod text;
pub mod video;

pub use check::check;
pub use ground::{Border, Ground};
pub use motion::{MOST_FRAMES, MOST_PIXELS as MOST_FRAME_PIXELS};
pub use style::{Color, Colors, Style};
