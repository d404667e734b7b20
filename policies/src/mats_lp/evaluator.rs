//! Batched calls of the network for the leaves of several searches.

use std::time::{Duration, Instant};

use pogema_core::Error;
use rustc_hash::FxHashMap;

use crate::mats_lp::cache::{Cache, Key, Prediction};
use crate::mats_lp::prior::{Evaluate, Evaluation, Prior};
use crate::network::softmax;

/// A known prediction, or the row of the batch that will hold it.
#[derive(Clone, Copy, Debug)]
pub(super) enum Pending {
    Known(Prediction),
    Row(u32),
}

/// The network and the batch of one thread.
pub(super) struct Evaluator {
    network: Box<dyn Evaluate>,
    input_len: usize,
    inputs: Vec<f32>,
    /// The keys of the batch, and the row of each.
    keys: Vec<Key>,
    rows: FxHashMap<Key, u32>,
    outputs: Vec<Evaluation>,
    predictions: Vec<Prediction>,
    stats: MatsLpStats,
}

/// The work of a policy since it was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MatsLpStats {
    /// Number of agent states for which a search requested an evaluation.
    pub num_requests: u64,
    /// Number of states that the network evaluated; the others were known.
    pub num_evaluated: u64,
    /// Longest time that any thread spent in the network.
    pub network_time: Duration,
}

impl MatsLpStats {
    /// Adds the work of another thread, which worked at the same time.
    pub(super) fn add_thread(&mut self, other: Self) {
        self.num_requests += other.num_requests;
        self.num_evaluated += other.num_evaluated;
        self.network_time = self.network_time.max(other.network_time);
    }
}

impl Evaluator {
    /// Largest number of rows in one call of the network.
    pub const MAX_ROWS: usize = 64;

    pub fn new(prior: &dyn Prior) -> Self {
        let side = 2 * prior.radius() + 1;
        Self {
            network: prior.evaluator(),
            input_len: 2 * side * side,
            inputs: Vec::new(),
            keys: Vec::new(),
            rows: FxHashMap::default(),
            outputs: Vec::new(),
            predictions: Vec::new(),
            stats: MatsLpStats::default(),
        }
    }

    /// Requests the prediction of a key. `write` writes its input, unless the prediction is known or already requested.
    pub fn request(&mut self, key: Key, cache: &Cache, write: impl FnOnce(&Key, &mut [f32])) -> Pending {
        self.stats.num_requests += 1;
        if let Some(&row) = self.rows.get(&key) {
            return Pending::Row(row);
        }
        if let Some(known) = cache.get(&key) {
            return Pending::Known(known);
        }
        let row = self.keys.len() as u32;
        let first = self.inputs.len();
        self.inputs.resize(first + self.input_len, 0.0);
        write(&key, &mut self.inputs[first..]);
        self.keys.push(key);
        self.rows.insert(key, row);
        Pending::Row(row)
    }

    /// Evaluates the batch and adds its predictions to the cache.
    ///
    /// # Errors
    /// Those of the network.
    pub fn run(&mut self, cache: &Cache) -> Result<(), Error> {
        self.outputs.clear();
        self.outputs.resize(self.keys.len(), Evaluation::default());
        let started = Instant::now();
        let inputs = self.inputs.chunks(Self::MAX_ROWS * self.input_len);
        for (inputs, outputs) in inputs.zip(self.outputs.chunks_mut(Self::MAX_ROWS)) {
            self.network.evaluate(inputs, outputs)?;
        }
        self.stats.num_evaluated += self.keys.len() as u64;
        self.stats.network_time += started.elapsed();
        self.predictions.clear();
        for (&key, output) in self.keys.iter().zip(&self.outputs) {
            let prediction = prediction(output);
            if is_finite(&prediction) {
                cache.insert(key, prediction);
            }
            self.predictions.push(prediction);
        }
        self.clear();
        Ok(())
    }

    /// Forgets the requests of a batch that was not run.
    pub fn clear(&mut self) {
        self.inputs.clear();
        self.keys.clear();
        self.rows.clear();
    }

    /// Returns the work since the evaluator was made.
    pub fn stats(&self) -> MatsLpStats {
        self.stats
    }

    /// Returns the prediction of a request of the batch that was run last; `None` if the network's outputs are not
    /// finite.
    pub fn prediction(&self, answer: Pending) -> Option<Prediction> {
        let prediction = match answer {
            Pending::Known(prediction) => prediction,
            Pending::Row(row) => self.predictions[row as usize],
        };
        is_finite(&prediction).then_some(prediction)
    }
}

/// Turns logits into probabilities. Logits that are not finite give probabilities that are not finite.
fn prediction(output: &Evaluation) -> Prediction {
    let mut probabilities = output.logits;
    if probabilities.iter().all(|logit| logit.is_finite()) {
        softmax(&mut probabilities);
    } else {
        probabilities.fill(f32::NAN);
    }
    Prediction { probabilities, value: output.value }
}

fn is_finite(prediction: &Prediction) -> bool {
    prediction.value.is_finite() && prediction.probabilities.iter().all(|value| value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stats_sum_the_requests_of_threads_and_keep_the_longest_time() {
        let of = |seconds| MatsLpStats {
            num_requests: 2,
            num_evaluated: 1,
            network_time: Duration::from_secs(seconds),
        };
        let mut stats = of(3);
        stats.add_thread(of(5));
        stats.add_thread(of(4));
        assert_eq!(
            stats,
            MatsLpStats { num_requests: 6, num_evaluated: 3, network_time: Duration::from_secs(5) }
        );
    }
}
