//! The loops for 8 or 16 agents, whose values lie side by side: `N` vectors hold one value of every agent.
//!
//! With AVX-512, eight agents use 256-bit vectors. They would fill only half of a 512-bit vector, and processors that
//! split 512-bit vectors run 256-bit ones faster.
//!
//! The sums have the terms and the order of `kernels`. The zeros of the margins are left out. They can change only the
//! sign of a zero sum, and the final `+ 0.0` removes that sign.

use super::kernels::Convolve;
use super::vector::Vector;
use super::{BLOCK, CHAINS, LANES, Shape};

/// Computes `C` output channels together at each pixel. `N` vectors `V` hold one value of every agent. The slices hold
/// rows of pixels of channels of agents, without margins.
///
/// # Safety
/// `super::convolve_agents` checked the job for `N * V::COUNT` agents, `C` divides `LANES`, and the instruction set of
/// `V` is enabled.
#[allow(clippy::inline_always, reason = "compiled with the features of its caller")]
#[inline(always)]
pub unsafe fn convolve<V: Vector, const N: usize, const C: usize>(job: &mut Convolve<'_>) {
    let Shape { output, input, kernel, .. } = job.shape;
    let taps = kernel[0] * kernel[1] * input.channels;
    for first in (0..output.channels).step_by(C) {
        let block = first - first % BLOCK;
        let width = BLOCK.min(output.stride - block);
        for row in 0..output.rows {
            for col in 0..output.cols {
                // SAFETY: the block of `width` channels begins after `block * taps` weights.
                unsafe {
                    let weights = job.weights.as_ptr().add(block * taps + first - block);
                    convolve_pixel::<V, N, C>(job, weights, width, first, [row, col]);
                }
            }
        }
    }
}

/// # Safety
/// As for `convolve`.
#[allow(clippy::inline_always, reason = "compiled with the features of its caller")]
#[inline(always)]
unsafe fn convolve_pixel<V: Vector, const N: usize, const C: usize>(
    job: &mut Convolve<'_>,
    weights: *const f32,
    width: usize,
    first: usize,
    [row, col]: [usize; 2],
) {
    let Shape { output, input, kernel, padding } = job.shape;
    let inside =
        |at: usize, size: usize, kernel: usize| padding.saturating_sub(at)..kernel.min(size + padding - at);
    let (down, right) = (inside(row, input.rows, kernel[0]), inside(col, input.cols, kernel[1]));
    let (channels, num_agents) = (input.channels, N * V::COUNT);
    // SAFETY: the job was checked, and `inside` skips the taps outside the input.
    unsafe {
        let mut sums: [[V; N]; C] =
            std::array::from_fn(|channel| [V::splat(*job.bias.as_ptr().add(first + channel)); N]);
        for tap_row in down {
            let pixel = (row + tap_row - padding) * input.cols + col + right.start - padding;
            let mut values = job.input.as_ptr().add(pixel * channels * num_agents);
            let mut factors = weights.add((tap_row * kernel[1] + right.start) * channels * width);
            // The pixels of a row are adjacent, and so are their weights.
            for _ in 0..right.len() * channels {
                let value: [V; N] = std::array::from_fn(|vector| V::load(values.add(vector * V::COUNT)));
                for (channel, sums) in sums.iter_mut().enumerate() {
                    let factor = V::splat(*factors.add(channel));
                    for (sum, value) in sums.iter_mut().zip(value) {
                        *sum = value.mul_add(factor, *sum);
                    }
                }
                values = values.add(num_agents);
                factors = factors.add(width);
            }
        }
        let at = ((row * output.cols + col) * output.channels + first) * num_agents;
        for (channel, sums) in sums.into_iter().enumerate().take(output.channels - first) {
            for (vector, sum) in sums.into_iter().enumerate() {
                let at = at + channel * num_agents + vector * V::COUNT;
                let mut sum = sum.add(V::splat(0.0));
                if let Some(added) = job.added {
                    sum = sum.add(V::load(added.as_ptr().add(at)));
                }
                if job.relu {
                    sum = sum.relu();
                }
                sum.store(job.output.as_mut_ptr().add(at));
            }
        }
    }
}

/// A dense layer of 8 or 16 agents. Input and output hold the first value of all agents, then the second, and so on.
pub struct MultiplyAgents<'a> {
    pub input: &'a [f32],
    pub output: &'a mut [f32],
    /// Laid out as the weights of `Multiply`.
    pub weights: &'a [f32],
    pub bias: &'a [f32],
    pub relu: bool,
}

/// Computes `C` outputs together. `N` vectors `V` hold one value of every agent.
///
/// # Safety
/// `super::multiply_agents` checked the job for `N * V::COUNT` agents, `C` divides `LANES`, and the instruction set of
/// `V` is enabled.
#[allow(clippy::inline_always, reason = "compiled with the features of its caller")]
#[inline(always)]
pub unsafe fn multiply<V: Vector, const N: usize, const C: usize>(job: &mut MultiplyAgents<'_>) {
    let num_agents = N * V::COUNT;
    let (num_inputs, num_outputs) = (job.input.len() / num_agents, job.output.len() / num_agents);
    for first in (0..num_outputs).step_by(C) {
        // SAFETY: the job was checked.
        unsafe {
            let block = first - first % LANES;
            let weights = job.weights.as_ptr().add(block * num_inputs + first - block);
            let mut sums = [[[V::splat(0.0); N]; C]; CHAINS];
            let mut add = |chain: usize, index: usize| {
                let value: [V; N] = std::array::from_fn(|vector| {
                    V::load(job.input.as_ptr().add(index * num_agents + vector * V::COUNT))
                });
                for (output, sums) in sums[chain].iter_mut().enumerate() {
                    let factor = V::splat(*weights.add(index * LANES + output));
                    for (sum, value) in sums.iter_mut().zip(value) {
                        *sum = value.mul_add(factor, *sum);
                    }
                }
            };
            let whole = num_inputs - num_inputs % CHAINS;
            for index in (0..whole).step_by(CHAINS) {
                for chain in 0..CHAINS {
                    add(chain, index + chain);
                }
            }
            for index in whole..num_inputs {
                add(index - whole, index);
            }
            for at in 0..C.min(num_outputs - first) * N {
                let (output, vector) = (at / N, at % N);
                let [a, b, c, d] = sums.map(|chain| chain[output][vector]);
                let bias = V::splat(*job.bias.as_ptr().add(first + output));
                let mut sum = a.add(b).add(c.add(d)).add(bias);
                if job.relu {
                    sum = sum.relu();
                }
                sum.store(job.output.as_mut_ptr().add((first + output) * num_agents + vector * V::COUNT));
            }
        }
    }
}
