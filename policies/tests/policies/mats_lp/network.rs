//! Small networks with drawn weights.

use std::sync::Arc;

use pogema_core::Error;
use pogema_numpy::Generator;
use pogema_policies::{Evaluate, Evaluation, Prior};

/// A linear network: five logits and a value.
#[derive(Clone, Debug)]
pub struct Linear {
    radius: usize,
    weights: Arc<[Vec<f32>; 6]>,
}

impl Linear {
    /// Draws the weights; a larger `scale` makes the distributions less even.
    pub fn new(radius: usize, scale: f64, generator: &mut Generator) -> Self {
        let len = 2 * (2 * radius + 1) * (2 * radius + 1);
        let draw = |generator: &mut Generator| (scale * (generator.random() - 0.5)) as f32;
        let weights = std::array::from_fn(|_| (0..len).map(|_| draw(generator)).collect());
        Self { radius, weights: Arc::new(weights) }
    }

    /// Evaluates one input.
    pub fn forward(&self, input: &[f32]) -> Evaluation {
        let dot = |weights: &Vec<f32>| weights.iter().zip(input).map(|(weight, x)| weight * x).sum::<f32>();
        let mut logits = [0.0; 5];
        for (logit, weights) in logits.iter_mut().zip(&self.weights[..5]) {
            *logit = dot(weights);
        }
        Evaluation { logits, value: dot(&self.weights[5]) }
    }
}

impl Prior for Linear {
    fn radius(&self) -> usize {
        self.radius
    }

    fn has_critic(&self) -> bool {
        true
    }

    fn evaluator(&self) -> Box<dyn Evaluate> {
        Box::new(self.clone())
    }
}

impl Evaluate for Linear {
    fn evaluate(&mut self, inputs: &[f32], out: &mut [Evaluation]) -> Result<(), Error> {
        assert_eq!(inputs.len() % out.len(), 0);
        for (input, out) in inputs.chunks_exact(inputs.len() / out.len()).zip(out) {
            *out = self.forward(input);
        }
        Ok(())
    }
}
