//! Checks that an implementation of POGEMA follows its rules.
//!
//! A [`Request`] is a config and a list of operations (reset, step, step back…); playing it gives a [`Response`]
//! with one [`Record`] per operation. [`play`] plays it with an engine of this workspace, [`Oracle`] with POGEMA
//! 1.4.0 itself, and [`compare`] finds the first place where two responses differ, and the rule it breaks.
//!
//! | module | what it holds |
//! | --- | --- |
//! | [`Request`], [`Response`], [`Record`] | what is asked and what is answered, as JSON |
//! | [`play`], [`NamedEngine`] | our engines' answers |
//! | [`Oracle`] | POGEMA's own answers |
//! | [`compare`], [`Divergence`] | the first difference, and its rule |
//! | [`draw_request`], [`Script`] | random configs and crowded episodes |
//! | [`Events`] | how often the interesting things happened |
//! | [`port`] | anyone's implementation, asked over a pipe |
//! | [`cases`], [`golden`] | what is kept on disk |
//! | [`Tally`] | what was checked, rule by rule |

#![forbid(unsafe_code)]

pub mod cases;
mod compare;
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
mod runner;
mod script;
mod tally;

pub use compare::{Divergence, Field, FieldPart, agents_grid, compare, compare_in, panel};
pub use draw::draw_request;
pub use events::Events;
pub use laws::{BrokenLaw, broken_law};
pub use literal::Literal;
pub use oracle::{Oracle, find_oracle_python};
pub use play::{NamedEngine, play, play_on};
pub use request::{
    Back, Derived, Failure, History, Op, Record, Registered, Request, ResetRecord, Response, StepRecord, When,
};
pub use runner::{Fault, Progress, Report, RunPart};
pub use script::{Script, play_script};
pub use tally::{Tally, families_of};
