//! All code with intrinsics: convolutions and dense layers.
//!
//! All paths return the same bits. They fuse each multiplication with its addition, which IEEE 754 defines exactly, and
//! add in the same order. The tests compare all paths that the machine supports.

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code, reason = "256-bit intrinsics")]
mod avx2;
#[allow(unsafe_code, reason = "pointers that the jobs' checks cover")]
mod kernels;
#[allow(unsafe_code, reason = "vectors read and write through pointers")]
mod lanes;

pub use kernels::{Convolve, Multiply};

/// Number of floats in a vector. The channels of activations are padded to a multiple of it.
pub const LANES: usize = 8;

/// Number of output channels that are computed together.
pub const BLOCK: usize = 2 * LANES;

/// Number of partial sums of each output of a dense layer.
const CHAINS: usize = 4;

/// The instruction set of a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Path {
    /// No intrinsics; available on every machine.
    Portable,
    /// AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    Avx2,
}

impl Path {
    /// Returns all paths that this machine supports, the fastest last.
    pub fn available() -> impl Iterator<Item = Self> {
        let all = [
            Some(Self::Portable),
            #[cfg(target_arch = "x86_64")]
            (is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")).then_some(Self::Avx2),
        ];
        all.into_iter().flatten()
    }

    /// Returns the fastest path that this machine supports.
    pub fn best() -> Self {
        Self::available().last().unwrap_or(Self::Portable)
    }
}

/// Rows of pixels of channels. Each row has margins of zeros on both sides, so that a convolution needs no bounds test.
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
    /// Returns the index of the first value that the first output of a row reads, if the first tap is in this row.
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
pub fn convolve(path: Path, mut job: Convolve<'_>) {
    let Shape { input, output, kernel: [rows, cols], padding } = job.shape;
    assert_eq!(output.rows + rows, input.rows + 2 * padding + 1);
    assert_eq!(output.cols + cols, input.cols + 2 * padding + 1);
    assert!(padding <= input.margin && padding < rows && padding < cols && input.channels <= input.stride);
    assert_eq!(output.stride % LANES, 0);
    assert_eq!((job.input.len(), job.output.len()), (input.len(), output.len()));
    assert!(job.added.is_none_or(|added| added.len() == output.len()));
    assert_eq!(job.weights.len(), rows * cols * input.channels * output.stride);
    assert_eq!(job.bias.len(), output.stride);
    // SAFETY: the asserts above: with `padding` inside the margins, each tap lies inside its row, and the kernels skip
    // the rows outside the input. `Path` only exists for what the machine supports.
    match path {
        Path::Portable => unsafe { kernels::convolve::<lanes::Portable>(&mut job) },
        #[cfg(target_arch = "x86_64")]
        Path::Avx2 => unsafe { avx2::convolve(&mut job) },
    }
}

/// Runs a dense layer.
///
/// # Panics
/// If a slice does not fit the numbers of inputs, outputs and rows.
#[allow(unsafe_code, reason = "the kernels read through pointers")]
pub fn multiply(path: Path, mut job: Multiply<'_>) {
    let num_outputs = job.bias.len();
    assert_eq!(num_outputs % LANES, 0);
    assert_eq!(job.weights.len(), num_outputs * job.num_inputs);
    assert!(job.num_inputs <= job.input_stride);
    assert!(job.num_rows == 0 || job.input.len() >= (job.num_rows - 1) * job.input_stride + job.num_inputs);
    assert!(job.output.len() >= job.num_rows * num_outputs);
    // SAFETY: the asserts above, and `Path` only exists for what the machine supports.
    match path {
        Path::Portable => unsafe { kernels::multiply::<lanes::Portable>(&mut job) },
        #[cfg(target_arch = "x86_64")]
        Path::Avx2 => unsafe { avx2::multiply(&mut job) },
    }
}
