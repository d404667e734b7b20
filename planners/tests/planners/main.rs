//! Tests of the planners, in one program, which links faster than several.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod cbs;
mod common;
mod ecbs;
mod joint;
mod lacam;
mod pbs;
mod pibt;
mod plan_text;
mod plans;
mod rhcr;
mod sipp;
