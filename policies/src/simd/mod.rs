//! All code with intrinsics: convolutions and dense layers.
//!
//! All paths return the same bits. They fuse each multiplication with its addition, which IEEE 754 defines exactly, and
//! add in the same order. The tests compare all paths that the machine supports.

#[allow(unsafe_code, reason = "pointers that the jobs' checks cover")]
mod agents;
#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code, reason = "256-bit intrinsics")]
mod avx2;
#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code, reason = "512-bit intrinsics")]
mod avx512;
#[cfg(test)]
mod guard_pages;
#[cfg(test)]
#[allow(unsafe_code, reason = "slices next to pages without access")]
#[path = "../../../fast/src/simd/guarded.rs"]
mod guarded;
#[allow(unsafe_code, reason = "pointers that the jobs' checks cover")]
mod kernels;
#[allow(unsafe_code, reason = "vectors read and write through pointers")]
mod vector;

use pogema_core::SimdPath;

pub use agents::MultiplyAgents;
pub use kernels::{Convolve, Multiply};

/// Number of floats in a vector of `kernels`. The channels of activations are padded to a multiple of it.
pub const LANES: usize = 8;

/// Number of output channels that are computed together.
pub const BLOCK: usize = 2 * LANES;

/// Largest number of agents whose values lie side by side in the kernels for many agents.
pub const AGENTS: usize = 16;

/// Number of agents of the smaller kernels for many agents.
pub const HALF: usize = AGENTS / 2;

/// Number of partial sums of each output of a dense layer.
const CHAINS: usize = 4;

/// Rows of pixels of channels. Each row has margins of zeros on both sides, so that a
/// convolution needs no bounds test for columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plane {
    pub rows: usize,
    pub cols: usize,
    pub channels: usize,
    /// Number of floats of a pixel: the channels, padded.
    pub stride: usize,
    /// Number of pixels in each margin.
    pub margin: usize,
}

impl Plane {
    /// Returns the number of floats of a row with its margins.
    pub fn row_len(&self) -> usize {
        (self.cols + 2 * self.margin) * self.stride
    }

    /// Returns the number of floats.
    pub fn len(&self) -> usize {
        self.rows * self.row_len()
    }

    /// Returns the number of values, without margins and padding.
    pub fn num_values(&self) -> usize {
        self.rows * self.cols * self.channels
    }

    /// Returns the index of a pixel.
    pub fn index(&self, row: usize, col: usize) -> usize {
        row * self.row_len() + (col + self.margin) * self.stride
    }
}

/// The planes, kernel and padding of a convolution.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    pub input: Plane,
    pub output: Plane,
    /// Rows and columns of the kernel.
    pub kernel: [usize; 2],
    /// Rows and columns of zeros around the input.
    pub padding: usize,
}

impl Shape {
    /// Returns the index of the first value that a row of outputs reads from a row of the input.
    fn input_index(&self, row: usize) -> usize {
        row * self.input.row_len() + (self.input.margin - self.padding) * self.input.stride
    }
}

/// Returns 0 for a value below 0, and every other value as it is, NaN included.
pub fn relu(value: f32) -> f32 {
    if 0.0 > value { 0.0 } else { value }
}

/// Runs a convolution.
///
/// # Panics
/// If a slice does not fit the shape.
#[allow(unsafe_code, reason = "the kernels read through pointers")]
pub fn convolve(path: SimdPath, mut job: Convolve<'_>) {
    let Shape { input, output, .. } = job.shape;
    check(&job.shape, job.weights, job.bias);
    assert_eq!((job.input.len(), job.output.len()), (input.len(), output.len()));
    assert!(job.added.is_none_or(|added| added.len() == output.len()));
    // SAFETY: the asserts above: with `padding` inside the margins, each tap lies inside its row, and the kernels skip
    // the rows outside the input. `Network::new` checked that the machine supports the path.
    match path {
        SimdPath::Scalar => unsafe { kernels::convolve::<vector::Portable, 2, vector::Portable>(&mut job) },
        #[cfg(target_arch = "x86_64")]
        SimdPath::Avx2 => unsafe { avx2::convolve(&mut job) },
        #[cfg(target_arch = "x86_64")]
        SimdPath::Avx512 => unsafe { avx512::convolve(&mut job) },
        #[cfg(not(target_arch = "x86_64"))]
        SimdPath::Avx2 | SimdPath::Avx512 => unreachable!("`Network::new` checks the path"),
    }
}

/// Runs a convolution of 8 or 16 agents, whose values lie side by side. The slices hold the pixels without margins.
///
/// # Panics
/// If a slice does not fit the shape.
#[allow(unsafe_code, reason = "the kernels read through pointers")]
pub fn convolve_agents(path: SimdPath, mut job: Convolve<'_>) {
    let Shape { input, output, .. } = job.shape;
    check(&job.shape, job.weights, job.bias);
    let num_agents = if job.input.len() == input.num_values() * HALF { HALF } else { AGENTS };
    assert_eq!(
        (job.input.len(), job.output.len()),
        (input.num_values() * num_agents, output.num_values() * num_agents)
    );
    assert!(job.added.is_none_or(|added| added.len() == job.output.len()));
    // SAFETY: the asserts above; the kernels skip the pixels outside the input. `Network::new` checked that the machine
    // supports the path.
    match (path, num_agents) {
        (SimdPath::Scalar, HALF) => unsafe { agents::convolve::<vector::Portable, 1, 4>(&mut job) },
        (SimdPath::Scalar, _) => unsafe { agents::convolve::<vector::Portable, 2, 4>(&mut job) },
        #[cfg(target_arch = "x86_64")]
        (SimdPath::Avx2 | SimdPath::Avx512, HALF) => unsafe { avx2::convolve_half(&mut job) },
        #[cfg(target_arch = "x86_64")]
        (SimdPath::Avx2, _) => unsafe { avx2::convolve_agents(&mut job) },
        #[cfg(target_arch = "x86_64")]
        (SimdPath::Avx512, _) => unsafe { avx512::convolve_agents(&mut job) },
        #[cfg(not(target_arch = "x86_64"))]
        (SimdPath::Avx2 | SimdPath::Avx512, _) => unreachable!("`Network::new` checks the path"),
    }
}

/// Checks that weights and planes fit together.
fn check(shape: &Shape, weights: &[f32], bias: &[f32]) {
    let Shape { input, output, kernel: [rows, cols], padding } = *shape;
    assert_eq!(output.rows + rows, input.rows + 2 * padding + 1);
    assert_eq!(output.cols + cols, input.cols + 2 * padding + 1);
    assert!(padding <= input.margin && padding < rows && padding < cols && input.channels <= input.stride);
    assert_eq!(output.stride, output.channels.next_multiple_of(LANES));
    assert_eq!(weights.len(), rows * cols * input.channels * output.stride);
    assert_eq!(bias.len(), output.stride);
}

/// Runs a dense layer.
///
/// # Panics
/// If a slice does not fit the numbers of inputs, outputs and rows.
#[allow(unsafe_code, reason = "the kernels read through pointers")]
pub fn multiply(path: SimdPath, mut job: Multiply<'_>) {
    let num_outputs = job.bias.len();
    assert_eq!(num_outputs % LANES, 0);
    assert_eq!(job.weights.len(), num_outputs * job.num_inputs);
    assert!(job.num_inputs <= job.input_stride);
    assert!(job.num_rows == 0 || job.input.len() >= (job.num_rows - 1) * job.input_stride + job.num_inputs);
    assert!(job.output.len() >= job.num_rows * num_outputs);
    // SAFETY: the asserts above, and `Network::new` checked that the machine supports the path.
    match path {
        SimdPath::Scalar => unsafe { kernels::multiply::<vector::Portable>(&mut job) },
        #[cfg(target_arch = "x86_64")]
        SimdPath::Avx2 | SimdPath::Avx512 => unsafe { avx2::multiply(&mut job) },
        #[cfg(not(target_arch = "x86_64"))]
        SimdPath::Avx2 | SimdPath::Avx512 => unreachable!("`Network::new` checks the path"),
    }
}

/// Runs a dense layer of 8 or 16 agents, whose values lie side by side.
///
/// # Panics
/// If a slice does not fit the numbers of inputs and outputs.
#[allow(unsafe_code, reason = "the kernels read through pointers")]
pub fn multiply_agents(path: SimdPath, mut job: MultiplyAgents<'_>) {
    let num_inputs = job.weights.len() / job.bias.len();
    let num_agents = if job.input.len() == num_inputs * HALF { HALF } else { AGENTS };
    assert_eq!((job.input.len(), job.output.len() % num_agents), (num_inputs * num_agents, 0));
    assert_eq!(job.bias.len(), (job.output.len() / num_agents).next_multiple_of(LANES));
    assert_eq!(job.weights.len(), job.bias.len() * num_inputs);
    // SAFETY: the asserts above, and `Network::new` checked that the machine supports the path.
    match (path, num_agents) {
        (SimdPath::Scalar, HALF) => unsafe { agents::multiply::<vector::Portable, 1, 1>(&mut job) },
        (SimdPath::Scalar, _) => unsafe { agents::multiply::<vector::Portable, 2, 1>(&mut job) },
        #[cfg(target_arch = "x86_64")]
        (SimdPath::Avx2 | SimdPath::Avx512, HALF) => unsafe { avx2::multiply_half(&mut job) },
        #[cfg(target_arch = "x86_64")]
        (SimdPath::Avx2, _) => unsafe { avx2::multiply_agents(&mut job) },
        #[cfg(target_arch = "x86_64")]
        (SimdPath::Avx512, _) => unsafe { avx512::multiply_agents(&mut job) },
        #[cfg(not(target_arch = "x86_64"))]
        (SimdPath::Avx2 | SimdPath::Avx512, _) => unreachable!("`Network::new` checks the path"),
    }
}
