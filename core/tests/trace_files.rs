//! Traces as files: whatever stands in one, reading it ends with a trace or a line that says what is wrong, and what
//! was written is read back as it was.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod mutate;

use std::sync::LazyLock;

use mutate::{assert_one_line, mutated, odd_value};
use pogema_core::{
    Action, Cell, Collision, Config, GoalStream, Instance, Map, Metrics, Observation, Observed, Occupancy, OnGoal,
    Outside, Reward, Snapshot, Trace, TraceHeader, TraceStart, TraceStep,
};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::{Index, select};
use serde_json::Value;
