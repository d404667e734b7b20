//! The loops of convolutions and dense layers, for vectors of any kind.
//!
//! Vectors hold adjacent output channels. Each output is a sum of its own, whose terms are added in a fixed order. It
//! therefore depends neither on the width of the vectors, nor on the size of a batch. `agents` has the same sums.

use super::vector::Vector;
use super::{BLOCK, CHAINS, LANES, Shape};

/// A convolution of one window, or of several agents (see `agents`). The slices hold rows of pixels of channels.
pub struct Convolve<'a> {
    /// The input from its first row on, each row with its margins.
    pub input: &'a [f32],
    pub output: &'a mut [f32],
    /// Added to the sums before the activation; laid out as the output.
    pub added: Option<&'a [f32]>,
    /// For each block of output channels: rows and columns of the kernel, input channels, output channels of the block.
    pub weights: &'a [f32],
    pub bias: &'a [f32],
    pub shape: Shape,
    pub relu: bool,
}

/// One row of the output and one block of its channels.
struct Row {
    /// The first value of the input that the row reads.
    input: *const f32,
    weights: *const f32,
    bias: *const f32,
    output: *mut f32,
    added: *const f32,
    /// Number of rows of the kernel that lie inside the input.
    num_taps: usize,
}

/// `N` vectors `W` hold a block of output channels, and one vector `V` a block of half the size at the end.
///
/// # Safety
/// `super::convolve` checked the job, and the instruction sets of `W` and `V` are enabled.
#[allow(clippy::inline_always, reason = "compiled with the features of its caller")]
#[inline(always)]
pub unsafe fn convolve<W: Vector, const N: usize, V: Vector>(job: &mut Convolve<'_>) {
    const { assert!(N * W::COUNT == BLOCK && V::COUNT == LANES) };
    let shape = job.shape;
    let [taps, kernel_cols] = shape.kernel;
    let mut first = 0;
    let mut weights = job.weights.as_ptr();
    while first < shape.output.stride {
        let width = BLOCK.min(shape.output.stride - first);
        let tap_weights = kernel_cols * shape.input.channels * width;
        for row in 0..shape.output.rows {
            let above = shape.padding.saturating_sub(row);
            let below = taps.min(shape.input.rows + shape.padding - row);
            // SAFETY: the job was checked, so every pixel and weight that a row reads lies inside its slice.
            unsafe {
                let out = shape.output.index(row, 0) + first;
                let row = Row {
                    input: job.input.as_ptr().add(shape.input_index(row + above - shape.padding)),
                    weights: weights.add(above * tap_weights),
                    bias: job.bias.as_ptr().add(first),
                    output: job.output.as_mut_ptr().add(out),
                    added: job.added.map_or(std::ptr::null(), |added| added.as_ptr().add(out)),
                    num_taps: below.saturating_sub(above),
                };
                if width == BLOCK {
                    convolve_row::<W, N>(&row, &shape, job.relu);
                } else {
                    convolve_row::<V, 1>(&row, &shape, job.relu);
                }
            }
        }
        // SAFETY: at most one past the last weight.
        weights = unsafe { weights.add(taps * tap_weights) };
        first += width;
    }
}

/// Splits a row into parts of nearly equal length. The parts are as long as the registers allow.
///
/// # Safety
/// As for `convolve`.
#[allow(clippy::inline_always, reason = "compiled with the features of its caller")]
#[inline(always)]
unsafe fn convolve_row<V: Vector, const N: usize>(row: &Row, shape: &Shape, relu: bool) {
    let cols = shape.output.cols;
    let longest = 12 / N;
    let num_parts = cols.div_ceil(longest);
    let mut first = 0;
    for part in 0..num_parts {
        let end = cols * (part + 1) / num_parts;
        let part = Row {
            // SAFETY: columns inside the row.
            input: unsafe { row.input.add(first * shape.input.stride) },
            output: unsafe { row.output.add(first * shape.output.stride) },
            added: row.added.wrapping_add(first * shape.output.stride),
            ..*row
        };
        let part = Part { is_added: !row.added.is_null(), relu, row: part };
        macro_rules! of_length {
            ($($length:literal)*) => {
                match end - first {
                    // SAFETY: as above.
                    $($length if $length <= 12 / N => unsafe { part.run::<V, $length, N>(shape) },)*
                    _ => unreachable!("a part has at most 12 / N pixels"),
                }
            };
        }
        of_length!(1 2 3 4 5 6 7 8 9 10 11 12);
        first = end;
    }
}

/// Adjacent pixels of a row.
struct Part {
    row: Row,
    is_added: bool,
    relu: bool,
}

impl Part {
    /// # Safety
    /// As for `convolve`.
    #[allow(clippy::inline_always, reason = "compiled with the features of its caller")]
    #[inline(always)]
    unsafe fn run<V: Vector, const P: usize, const N: usize>(&self, shape: &Shape) {
        let row = &self.row;
        let (pixel, channels) = (shape.input.stride, shape.input.channels);
        // SAFETY: the job was checked; see `convolve`.
        unsafe {
            let bias: [V; N] = std::array::from_fn(|vector| V::load(row.bias.add(vector * V::COUNT)));
            let mut sums = [bias; P];
            let mut weights = row.weights;
            for tap in 0..row.num_taps {
                let mut values = row.input.add(tap * shape.input.row_len());
                for _ in 0..shape.kernel[1] {
                    for channel in 0..channels {
                        let factors: [V; N] =
                            std::array::from_fn(|vector| V::load(weights.add(vector * V::COUNT)));
                        for (index, sums) in sums.iter_mut().enumerate() {
                            let value = V::splat(*values.add(index * pixel + channel));
                            for (sum, factor) in sums.iter_mut().zip(factors) {
                                *sum = value.mul_add(factor, *sum);
                            }
                        }
                        weights = weights.add(N * V::COUNT);
                    }
                    values = values.add(pixel);
                }
            }
            for (index, sums) in sums.into_iter().enumerate() {
                for (vector, mut sum) in sums.into_iter().enumerate() {
                    let at = index * shape.output.stride + vector * V::COUNT;
                    sum = sum.add(V::splat(0.0));
                    if self.is_added {
                        sum = sum.add(V::load(row.added.add(at)));
                    }
                    if self.relu {
                        sum = sum.relu();
                    }
                    sum.store(row.output.add(at));
                }
            }
        }
    }
}

/// A dense layer for some rows.
pub struct Multiply<'a> {
    /// One row after another. Each row begins `input_stride` values after the previous one.
    pub input: &'a [f32],
    /// One row of outputs after another. Each row has as many outputs as `bias` has values.
    pub output: &'a mut [f32],
    /// For each vector of outputs: inputs, outputs of the vector.
    pub weights: &'a [f32],
    pub bias: &'a [f32],
    pub num_inputs: usize,
    pub input_stride: usize,
    pub num_rows: usize,
    pub relu: bool,
}

/// # Safety
/// `super::multiply` checked the job, and the instruction set of `V` is enabled.
#[allow(clippy::inline_always, reason = "compiled with the features of its caller")]
#[inline(always)]
pub unsafe fn multiply<V: Vector>(job: &mut Multiply<'_>) {
    const MAX_ROWS: usize = 3;
    for first in (0..job.bias.len()).step_by(V::COUNT) {
        let mut row = 0;
        while row < job.num_rows {
            // SAFETY: as above.
            unsafe {
                match job.num_rows - row {
                    1 => multiply_rows::<V, 1>(job, row, first),
                    2 => multiply_rows::<V, 2>(job, row, first),
                    _ => multiply_rows::<V, MAX_ROWS>(job, row, first),
                }
            }
            row += MAX_ROWS;
        }
    }
}

/// Adds the products in `CHAINS` sums, because each addition to a single sum would wait for the one before.
///
/// # Safety
/// As for `multiply`.
#[allow(clippy::inline_always, reason = "compiled with the features of its caller")]
#[inline(always)]
unsafe fn multiply_rows<V: Vector, const P: usize>(job: &mut Multiply<'_>, row: usize, first: usize) {
    let (num_inputs, stride) = (job.num_inputs, job.input_stride);
    // SAFETY: the job was checked.
    unsafe {
        let input = job.input.as_ptr().add(row * stride);
        let weights = job.weights.as_ptr().add(first * num_inputs);
        let mut sums = [[V::splat(0.0); P]; CHAINS];
        let mut add = |chain: usize, index: usize| {
            let factor = V::load(weights.add(index * V::COUNT));
            for (row, sum) in sums[chain].iter_mut().enumerate() {
                *sum = V::splat(*input.add(row * stride + index)).mul_add(factor, *sum);
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
        let bias = V::load(job.bias.as_ptr().add(first));
        let [one, two, three, four] = sums;
        for (index, (one, two)) in one.into_iter().zip(two).enumerate() {
            let mut sum = one.add(two).add(three[index].add(four[index])).add(bias);
            if job.relu {
                sum = sum.relu();
            }
            sum.store(job.output.as_mut_ptr().add((row + index) * job.bias.len() + first));
        }
    }
}
