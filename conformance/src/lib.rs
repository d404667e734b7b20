//! Checks that an implementation of POGEMA follows its rules.
//!
//! A [`Request`] is a config and a list of operations (reset, step, step back…). The answer is a [`Response`] with
//! one [`Record`] per operation. [`play`] answers with an engine of this workspace, [`Oracle`] with POGEMA 1.4.0
//! itself. [`compare`] finds the first difference between two responses and the rule it breaks.
//!
//! | item | content |
//! | --- | --- |
//! | [`Request`], [`Response`], [`Record`] | requests and answers, as JSON |
//! | [`play`], [`NamedEngine`] | answers of the engines of this workspace |
//! | [`Oracle`] | answers of POGEMA 1.4.0 |
//! | [`compare`], [`Divergence`] | the first difference and its rule |
//! | [`draw_request`], [`draw_extended_request`], [`Script`] | random configs and crowded episodes |
//! | [`Events`] | counts of conflicts and other events in the episodes |
//! | [`port`] | implementations in any language, queried over a pipe |
//! | [`cases`], [`golden`] | cases and recordings on disk |
//! | [`Tally`] | counts of comparisons, rule by rule |
//! | [`vectors`] | the cases and some recordings as plain JSON, for tests without this kit |
//! | [`rules`] | the names of the rules and what they say |

#![forbid(unsafe_code)]

pub mod cases;
mod compare;
mod data;
mod dice;
mod digits;
mod draw;
mod events;
pub mod files;
pub mod golden;
mod laws;
mod literal;
mod oracle;
mod play;
pub mod port;
mod request;
pub mod rules;
mod runner;
mod script;
mod tally;
pub mod vectors;

pub use compare::{Divergence, Field, FieldPart, compare, compare_in, panel};
pub use draw::{draw_extended_request, draw_request};
pub use events::Events;
pub use laws::{BrokenLaw, broken_law};
pub use literal::Literal;
pub use oracle::{Oracle, find_oracle_python};
pub use play::{NamedEngine, play, play_on};
pub use request::{
    Back, Derived, Failure, History, Op, Record, Registered, Request, ResetRecord, Response, StepRecord, When,
};
pub use runner::{Fault, Report, RunPart, Watch};
pub use script::{Script, play_script};
pub use tally::{Tally, rules_of};

/// The README, whose example the tests compile and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
