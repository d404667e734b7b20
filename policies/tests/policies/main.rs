//! Encoders, planners and policies against slow code, recordings and bad input.

mod common;
mod encode_errors;
mod encoders;
mod follower_recorded;
mod mats_lp;
