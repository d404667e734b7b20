//! Tests of encoders, planners and policies, with reference implementations, recordings and invalid input.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;
mod encode_errors;
mod encoders;
mod follower_recorded;
mod learned;
mod mats_lp;
mod named;
#[path = "../common/mod.rs"]
mod recorded;
mod shipped;
mod simd_variable;
mod switchers;
