//! The words of pogema-rs: what every other crate speaks and none of the rules.
//!
//! An episode of POGEMA is a pure function of an [`Instance`] (map, starts, goals) and the agents' [`Action`]s.
//! A [`Config`] fixes its rules and the shape of every array; an [`Environment`] plays it; a [`Trace`] is what
//! happened, step by step; [`metrics`] sum it up. Engines draw no random numbers: where goals are drawn, the
//! instance brings a [`GoalStream`].
//!
//! | module | what it holds |
//! | --- | --- |
//! | [`Cell`], [`Action`] | places and moves, row first |
//! | [`Map`], [`Instance`], [`Outside`], [`GoalStream`] | what is played on |
//! | [`Config`] | which rules are played by |
//! | [`Environment`], [`StepOut`], [`State`], [`Snapshot`] | what an engine offers |
//! | [`Episode`] | an engine at play, measured and recorded |
//! | [`Trace`] | a recorded episode, as JSON lines |
//! | [`metrics`] | CSR, ISR, sum of costs, makespan, throughput and the like |
//! | [`files`] | files that are written whole or not at all |
//! | [`picture`] | text pictures of a state |
//! | [`words!`], [`Words`] | enums whose variants are words in files, flags and Python |
//! | [`Error`] | the one error type |

#![forbid(unsafe_code)]

mod cell;
mod config;
mod environment;
mod episode;
mod error;
pub mod files;
mod goals;
mod history;
mod instance;
mod map;
pub mod metrics;
mod observe;
pub mod picture;
mod threads;
mod trace;
mod words;

#[doc(hidden)]
pub use serde;

pub use cell::{Action, Cell};
pub use config::{Collision, Config, Observation, Occupancy, OnGoal, Reward};
pub use environment::{Environment, Snapshot, State, StepOut, StepResults};
pub use episode::{Episode, Meters, Recording};
pub use error::{BoxedError, Cause, Error, shorten, unknown_letter};
pub use goals::{GoalSource, GoalStream, StreamState};
pub use history::{Change, changes, states_at_every_step};
pub use instance::{Instance, Outside};
pub use map::{Map, check_row_length};
pub use metrics::{CollisionMeter, DensityMeter, EpisodeMeter, Metrics, Seen};
pub use observe::{from_border, from_starts};
pub use threads::{MAX_THREADS, check_threads, threads_note};
pub use trace::{Observed, ObservedMapf, ObservedPomapf, Padded, Trace, TraceHeader, TraceStart, TraceStep};
pub use words::{Word, Words, deserialize_word, serialize_word};
