//! Probabilities from logits.

/// Replaces logits by their probabilities.
///
/// The exponential is the same on every machine. Values: 0 to 1, with a sum of 1 up to rounding.
pub fn softmax(logits: &mut [f32]) {
    let largest = logits.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let mut sum = 0.0;
    for logit in &mut *logits {
        *logit = libm::expf(*logit - largest);
        sum += *logit;
    }
    for logit in logits {
        *logit /= sum;
    }
}
