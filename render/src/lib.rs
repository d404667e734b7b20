//! Pictures of episodes.
//!
//! The crate draws pictures from a [`pogema_core::Trace`]; [`text`] also draws single states. A [`Style`] or
//! [`text::Style`] sets their appearance. Frame 0 is the state after the reset, frame 1 the state after the first step.
//!
//! | module | output |
//! | --- | --- |
//! | [`svg`] | SVG animations and pictures for browsers and papers |
//! | [`text`] | frames for the terminal |
//! | [`raster`] | one frame as PNG |
//! | [`gif`] | GIF animations |
//! | [`video`] | MP4 and `WebM` videos, encoded by the program ffmpeg |
//! | [`html`] | pages that replay episodes, and a map editor |
//! | [`reverted_moves`] | the rule that reverted each reverted move |

#![forbid(unsafe_code)]

mod check;
pub mod gif;
mod ground;
pub mod html;
mod motion;
mod numbers;
pub mod raster;
pub mod reverted_moves;
mod scene;
mod style;
pub mod svg;
pub mod text;
pub mod video;

pub use check::check;
pub use ground::{Border, Ground};
pub use motion::{MAX_FRAMES, MAX_PIXELS as MAX_FRAME_PIXELS};
pub use style::{Color, Colors, Style};

/// The README, whose example the tests compile and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
