//! Uses `rten` to run graphs that are not lists of layers, one agent at a time.
//!
//! The order of rten's sums depends on the batch size, so batches would change the bits.

use std::sync::Arc;

use rten::{Model, RunOptions, ThreadPool};
use rten_tensor::NdTensor;
use rten_tensor::prelude::*;

/// The largest number of values of a window.
const MAX_VALUES: usize = 1 << 24;

/// A graph that returns logits of a window.
pub struct Runtime {
    model: Model,
    options: RunOptions,
    pub window: [usize; 3],
    pub num_actions: usize,
    /// Why the graph is not a list of layers.
    pub reason: String,
}

impl Runtime {
    /// Reads a graph that was cut at its logits. Errors are messages without the path. If an operator is not supported,
    /// the message names it.
    pub fn read(bytes: Vec<u8>, window: [usize; 3], reason: String) -> Result<Self, String> {
        let num_values = window.iter().try_fold(1usize, |product, size| product.checked_mul(*size));
        if !num_values.is_some_and(|num_values| (1..=MAX_VALUES).contains(&num_values)) {
            return Err(format!("the window has shape {window:?}, expected 1 to {MAX_VALUES} values"));
        }
        let model = Model::load(bytes).map_err(|error| error.to_string())?;
        if model.input_ids().len() != 1 {
            let num_inputs = model.input_ids().len();
            return Err(format!("the logits depend on {num_inputs} inputs, expected the window alone"));
        }
        let pool = Arc::new(ThreadPool::with_num_threads(1));
        let options = RunOptions::default().with_thread_pool(Some(pool));
        let mut runtime = Self { model, options, window, num_actions: 0, reason };
        let mut logits = Vec::new();
        runtime.run(&vec![0.0; window.iter().product()], &mut logits)?;
        runtime.num_actions = logits.len();
        Ok(runtime)
    }

    /// Appends the logits of an agent. Errors are messages without the path.
    pub fn run(&self, window: &[f32], logits: &mut Vec<f32>) -> Result<(), String> {
        let [channels, rows, cols] = self.window;
        let input = NdTensor::from_data([1, channels, rows, cols], window.to_vec());
        let inputs = vec![(self.model.input_ids()[0], input.into())];
        let outputs = self.model.run(inputs, self.model.output_ids(), Some(self.options.clone()));
        let output = outputs.map_err(|error| error.to_string())?.into_iter().next();
        let output: Result<NdTensor<f32, 2>, _> = output.ok_or("the graph returns nothing")?.try_into();
        let wrong = "the logits have another type or shape, expected floats of shape (batch, actions)";
        let output = output.map_err(|_| wrong)?;
        if output.size(0) != 1 || output.size(1) == 0 {
            return Err(format!("the logits have shape {:?}, expected (1, actions)", output.shape()));
        }
        logits.extend(output.iter());
        Ok(())
    }
}

impl std::fmt::Debug for Runtime {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Runtime").field("window", &self.window).finish_non_exhaustive()
    }
}
