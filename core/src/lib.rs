//! The shared types of pogema-rs. This crate implements the rules of metrics, histories and goal sequences; the engines
//! implement the rules of resets, steps and observation windows.
//!
//! An episode of POGEMA is a pure function of an [`Instance`] (map, starts, goals) and the agents' [`Action`]s.
//! A [`Config`] determines the rules of the episode and, with the size of the map, the shape of every array. An
//! [`Environment`] plays the episode, a [`Trace`] records every step, and [`metrics`] evaluate the episode. Engines
//! draw no random numbers: if goals are random, the instance supplies them through a [`GoalStream`].
//!
//! | item | content |
//! | --- | --- |
//! | [`Cell`], [`Action`] | cells and moves, row first |
//! | [`Map`], [`Instance`], [`Outside`], [`GoalStream`] | the input of an episode |
//! | [`Config`] | the rules of an episode |
//! | [`Environment`], [`StepOut`], [`State`], [`Snapshot`] | the interface of an engine |
//! | [`Episode`] | an engine with metrics and a recording |
//! | [`Trace`] | a recorded episode, as JSON Lines |
//! | [`metrics`] | metrics such as CSR, ISR, sum of costs, makespan and throughput |
//! | [`files`] | bounded file reads and atomic file writes |
//! | [`picture`] | text pictures of a state |
//! | [`words!`], [`Words`] | enums whose variants are words in files, flags and Python |
//! | [`SimdPath`] | the instruction set of engines and networks |
//! | [`Error`] | the error type |

#![forbid(unsafe_code)]

mod cell;
mod config;
mod environment;
mod episode;
mod error;
pub mod files;
mod goals;
mod history;
mod input;
mod instance;
mod map;
pub mod metrics;
mod observe;
pub mod picture;
mod printable;
mod simd_path;
mod threads;
mod trace;
mod words;

#[doc(hidden)]
pub use serde;

pub use cell::{Action, Cell};
pub use config::{Collision, Config, Observation, Occupancy, OnGoal, Reward};
pub use environment::{Environment, Snapshot, State, StepOut, StepResults};
pub use episode::{Episode, Meters, Recording};
pub use error::{BoxedError, Cause, Error, counted, listed, rows_and_columns, shorten, unknown_character};
pub use goals::{GoalSource, GoalStream, StreamState};
pub use history::{Change, changes, states_at_every_step};
pub use input::{Bounded, InputLimit};
pub use instance::{Instance, Outside};
pub use map::{Map, check_row_length, uneven_row};
pub use metrics::{CollisionMeter, DensityMeter, EpisodeMeter, LARGEST_STEP, Metrics, Seen};
pub use observe::{from_border, from_starts};
pub use printable::{is_unprintable, one_line, printable_json};
pub use simd_path::SimdPath;
pub use threads::{MAX_THREADS, check_threads, threads_note};
pub use trace::{
    Observed, ObservedMapf, ObservedPomapf, Padded, SPEC, Trace, TraceHeader, TraceStart, TraceStep,
};
pub use words::{Word, Words, deserialize_word, serialize_word};

/// The README, whose example the tests compile and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
