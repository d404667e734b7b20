//! The compiled part of the Python package `pogema_rs`; the Python modules define the public names.

mod astar;
mod config;
mod engine;
mod errors;
mod evaluation;
mod fields;
mod guard;
mod instances;
mod interrupt;
mod lists;
mod maps;
mod memory;
mod planners;
mod policies;
mod vec;
mod views;

use pogema_core::{Collision, Observation, OnGoal, Words};
use pogema_maps::Integration;
use pogema_policies::{Channel, FollowerVersion, LearnedName, Sampling, Scalars};
use pyo3::prelude::*;
use pyo3::types::PyDict;

#[pymodule]
fn _engine(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<engine::Engine>()?;
    module.add_class::<vec::Batch>()?;
    module.add_class::<astar::AStarAgent>()?;
    module.add_class::<planners::PlanFollower>()?;
    module.add_class::<planners::Stop>()?;
    module.add_class::<policies::Policy>()?;
    module.add_class::<evaluation::Evaluation>()?;
    module.add_function(wrap_pyfunction!(evaluation::machine, module)?)?;
    module.add_function(wrap_pyfunction!(evaluation::play_built_in, module)?)?;
    module.add_function(wrap_pyfunction!(views::check_views, module)?)?;
    module.add_function(wrap_pyfunction!(views::show_views, module)?)?;
    module.add_function(wrap_pyfunction!(vec::num_cores, module)?)?;
    module.add_function(wrap_pyfunction!(guard::force_panic, module)?)?;
    module.add("MAX_THREADS", pogema_core::MAX_THREADS)?;
    module.add("WORDS", words(module.py())?)?;
    module.add_function(wrap_pyfunction!(config::derive_config, module)?)?;
    module.add_function(wrap_pyfunction!(config::did_you_mean, module)?)?;
    module.add_function(wrap_pyfunction!(policies::write_network, module)?)?;
    module.add_function(wrap_pyfunction!(planners::make_plan, module)?)?;
    module.add_function(wrap_pyfunction!(planners::check_plan, module)?)?;
    module.add_function(wrap_pyfunction!(planners::cost_to_go, module)?)?;
    module.add_function(wrap_pyfunction!(instances::make_instances, module)?)?;
    module.add_function(wrap_pyfunction!(maps::maze, module)?)?;
    module.add_function(wrap_pyfunction!(maps::movingai_map, module)?)?;
    module.add_function(wrap_pyfunction!(maps::random_map, module)?)?;
    module.add_function(wrap_pyfunction!(maps::warehouse, module)?)?;
    module.add_function(wrap_pyfunction!(maps::warehouse_cells, module)?)?;
    module.add_function(wrap_pyfunction!(astar::restore_astar, module)?)?;
    module.add_function(wrap_pyfunction!(engine::state::restore_engine, module)?)?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))
}

/// Returns the words that config fields and arguments accept, keyed by field or by kind of argument.
fn words(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let words = PyDict::new(py);
    words.set_item("on_target", OnGoal::NAMES)?;
    words.set_item("collision_system", Collision::NAMES)?;
    words.set_item("observation_type", Observation::NAMES)?;
    words.set_item("integration", Integration::NAMES)?;
    words.set_item("channel", Channel::NAMES)?;
    words.set_item("scalars", Scalars::NAMES)?;
    words.set_item("follower", FollowerVersion::NAMES)?;
    words.set_item("sampling", Sampling::NAMES)?;
    words.set_item("learned", LearnedName::NAMES)?;
    Ok(words)
}
