//! The axes of values. PyTorch's recurrent layers need an axis for time; the operators around them add, move and remove
//! it. These operators do not change the values of an agent, so they have no layer.

/// The largest number of axes of a value, and of sizes in a list. Graphs of PyTorch use at most four.
const MAX_RANK: usize = 8;

/// An axis of a value that holds one list for each agent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// One entry for each agent.
    Batch,
    /// The values of an agent.
    Values,
    /// A single entry. In a graph for one agent, the axis of the batch is also of this kind.
    One,
}

/// A size that the graph computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    Batch,
    Fixed(i64),
}

impl Size {
    fn times(self, other: Self) -> Option<Self> {
        match (self, other) {
            (Self::Fixed(one), Self::Fixed(other)) => Some(Self::Fixed(one.checked_mul(other)?)),
            (Self::Batch, Self::Fixed(1)) | (Self::Fixed(1), Self::Batch) => Some(Self::Batch),
            _ => None,
        }
    }
}

/// Joins lists of sizes.
pub fn joined(lists: &[Vec<Size>]) -> Option<Vec<Size>> {
    let len = lists.iter().map(Vec::len).try_fold(0usize, usize::checked_add)?;
    (len <= MAX_RANK).then(|| lists.concat())
}

/// Reads sizes from a constant.
pub fn sizes(integers: Vec<i64>) -> Option<Vec<Size>> {
    (integers.len() <= MAX_RANK).then(|| integers.into_iter().map(Size::Fixed).collect())
}

/// Multiplies two lists of sizes element by element.
pub fn product(one: &[Size], other: &[Size]) -> Option<Vec<Size>> {
    (one.len() == other.len()).then_some(())?;
    one.iter().zip(other).map(|(one, other)| one.times(*other)).collect()
}

/// Returns the index of an entry; a negative `entry` counts from the end.
pub fn index(entry: i64, len: usize) -> Option<usize> {
    let entry = if entry < 0 { entry.checked_add(i64::try_from(len).ok()?)? } else { entry };
    usize::try_from(entry).ok().filter(|entry| *entry < len)
}

/// Returns the indices of entries; negative ones count from the end.
fn indices(entries: &[i64], len: usize) -> Option<Vec<usize>> {
    entries.iter().map(|entry| index(*entry, len)).collect()
}

/// Returns the sizes from `first` up to but not including `end`, which may lie past the last size.
pub fn range(sizes: &[Size], first: i64, end: Option<i64>) -> Option<Vec<Size>> {
    let len = i64::try_from(sizes.len()).ok()?;
    let bound = |at: i64| if at < 0 { at.saturating_add(len).max(0) } else { at.min(len) };
    let (first, end) = (bound(first), end.map_or(len, bound));
    Some(sizes.get(usize::try_from(first).ok()?..usize::try_from(end).ok()?)?.to_vec())
}

/// Returns the axes after `Unsqueeze`.
pub fn unsqueezed(axes: &[Axis], at: &[i64]) -> Option<Vec<Axis>> {
    let rank = axes.len().checked_add(at.len()).filter(|rank| *rank <= MAX_RANK)?;
    let at = indices(at, rank)?;
    let mut rest = axes.iter();
    (0..rank).map(|axis| if at.contains(&axis) { Some(Axis::One) } else { rest.next().copied() }).collect()
}

/// Returns the axes after `Squeeze`. Without `at`, it removes all axes that can be removed. `len` is the number of
/// values of an agent.
pub fn squeezed(axes: &[Axis], at: Option<&[i64]>, len: usize) -> Option<Vec<Axis>> {
    let single = |axis: Axis| axis == Axis::One || axis == Axis::Values && len == 1;
    let Some(at) = at else {
        return Some(axes.iter().copied().filter(|axis| !single(*axis)).collect());
    };
    let at = indices(at, axes.len())?;
    at.iter().all(|axis| single(axes[*axis])).then_some(())?;
    let kept = axes.iter().enumerate().filter(|(axis, _)| !at.contains(axis));
    Some(kept.map(|(_, axis)| *axis).collect())
}

/// Returns the axes after `Transpose`. Without `order`, it reverses them.
pub fn transposed(axes: &[Axis], order: &[i64]) -> Option<Vec<Axis>> {
    if order.is_empty() {
        return Some(axes.iter().rev().copied().collect());
    }
    (order.len() == axes.len()).then_some(())?;
    let order = indices(order, axes.len())?;
    (0..axes.len()).all(|axis| order.contains(&axis)).then_some(())?;
    Some(order.iter().map(|axis| axes[*axis]).collect())
}

/// Returns the axes after `Flatten`, which joins the axes before `at` into one axis, and the others into another.
pub fn flattened(axes: &[Axis], at: i64) -> Option<[Axis; 2]> {
    let at = if at == 0 { 0 } else { index(at, axes.len())? };
    let joined = |part: &[Axis]| {
        let mut long = part.iter().copied().filter(|axis| *axis != Axis::One);
        let joined = long.next().unwrap_or(Axis::One);
        long.next().is_none().then_some(joined)
    };
    Some([joined(&axes[..at])?, joined(&axes[at..])?])
}

/// Returns the axes after `Reshape` to some sizes. `len` is the number of values of an agent, and `batch` the size of
/// the batch, if it is fixed. With `copies`, a size of 0 stands for the size that the same axis had before.
pub fn reshaped(
    axes: &[Axis],
    len: usize,
    batch: Option<i64>,
    sizes: &[Size],
    copies: bool,
) -> Option<Vec<Axis>> {
    let is = |axis: Axis, size: Size| match (axis, size) {
        (Axis::Batch, Size::Batch) | (_, Size::Fixed(-1)) => true,
        (Axis::Batch, Size::Fixed(size)) => batch == Some(size),
        (Axis::Values, Size::Fixed(size)) => usize::try_from(size) == Ok(len),
        (Axis::One, Size::Fixed(size)) => size == 1,
        (_, Size::Batch) => false,
    };
    // `Reshape` keeps the order of the entries, and therefore also the order of the axes that have several entries.
    let mut rest = axes.iter().copied().filter(|axis| *axis != Axis::One).peekable();
    let num_open = sizes.iter().filter(|size| **size != Size::Fixed(1)).count();
    let is_inferred_one = num_open > rest.clone().count();
    let mut out = Vec::new();
    for (at, size) in sizes.iter().enumerate() {
        let size = if copies && *size == Size::Fixed(0) {
            match axes.get(at)? {
                Axis::Batch => Size::Batch,
                Axis::Values => Size::Fixed(i64::try_from(len).ok()?),
                Axis::One => Size::Fixed(1),
            }
        } else {
            *size
        };
        let is_one = size == Size::Fixed(1) || size == Size::Fixed(-1) && is_inferred_one;
        let fits = rest.peek().is_some_and(|next| is(*next, size)) && !(is_one && len > 1);
        if fits {
            out.extend(rest.next());
        } else if is_one {
            out.push(Axis::One);
        } else {
            return None;
        }
    }
    // If an agent has only one value, this value may lose its axis.
    rest.all(|axis| axis == Axis::Values && len == 1).then_some(out)
}

#[cfg(test)]
mod tests {
    use super::Axis::{Batch, One, Values};
    use super::*;

    fn sizes(list: &[i64]) -> Vec<Size> {
        list.iter().map(|size| if *size == 99 { Size::Batch } else { Size::Fixed(*size) }).collect()
    }

    #[test]
    fn axes_of_one_entry_are_added_and_removed() {
        assert_eq!(unsqueezed(&[Batch, Values], &[0]), Some(vec![One, Batch, Values]));
        assert_eq!(unsqueezed(&[Batch, Values], &[-2, 0]), Some(vec![One, Batch, One, Values]));
        assert_eq!(unsqueezed(&[Batch, Values], &[3]), None);
        assert_eq!(unsqueezed(&[Batch, Values], &[1, 1]), None);
        assert_eq!(unsqueezed(&[Batch, Values], &[0; 7]), None, "too many axes");
        assert_eq!(squeezed(&[One, Batch, Values], Some(&[0]), 4), Some(vec![Batch, Values]));
        assert_eq!(squeezed(&[One, Batch, Values], Some(&[-2]), 4), None);
        assert_eq!(squeezed(&[One, Batch, Values], Some(&[-1]), 1), Some(vec![One, Batch]));
        assert_eq!(squeezed(&[One, Batch, Values], None, 4), Some(vec![Batch, Values]));
    }

    #[test]
    fn transpose_reorders_axes_and_rejects_invalid_orders() {
        assert_eq!(transposed(&[Batch, One, Values], &[1, 0, 2]), Some(vec![One, Batch, Values]));
        assert_eq!(transposed(&[Batch, Values], &[]), Some(vec![Values, Batch]));
        for wrong in [&[0][..], &[0, 0], &[0, 2], &[0, 1, 1]] {
            assert_eq!(transposed(&[Batch, Values], wrong), None, "{wrong:?}");
        }
    }

    #[test]
    fn lists_of_more_than_8_sizes_are_rejected() {
        assert_eq!(
            joined(&[vec![Size::Batch], vec![Size::Fixed(4)]]),
            Some(vec![Size::Batch, Size::Fixed(4)])
        );
        assert_eq!(joined(&[vec![Size::Batch; 8], vec![Size::Batch]]), None);
        assert_eq!(
            (super::sizes(vec![1; 9]), super::sizes(vec![1; 8]).map(|sizes| sizes.len())),
            (None, Some(8))
        );
    }

    #[test]
    fn flatten_joins_the_axes_before_and_after_an_index() {
        assert_eq!(flattened(&[One, Batch, One, Values], 2), Some([Batch, Values]));
        assert_eq!(flattened(&[One, Batch, One, Values], -1), Some([Batch, Values]));
        assert_eq!(flattened(&[One, Batch, Values], 1), None);
        assert_eq!(flattened(&[One, Values], 0), Some([One, Values]));
        assert_eq!(flattened(&[Batch, Values], 3), None);
    }

    #[test]
    fn a_reshape_keeps_the_order_of_the_axes() {
        let of = |axes: &[Axis], list: &[i64]| reshaped(axes, 4, None, &sizes(list), true);
        let sequence = [One, Batch, One, Values];
        assert_eq!(of(&sequence, &[1, -1, 4]), Some(vec![One, Batch, Values]));
        assert_eq!(of(&sequence, &[99, 4]), Some(vec![Batch, Values]));
        assert_eq!(of(&sequence, &[99, -1]), Some(vec![Batch, Values]));
        assert_eq!(of(&sequence, &[-1, 99, 4]), Some(vec![One, Batch, Values]));
        assert_eq!(of(&[Batch, Values], &[0, 1, 4]), Some(vec![Batch, One, Values]));
        assert_eq!(of(&[Batch, Values], &[0, 1, 0]), None, "the input of the reshape has no third axis");
        for wrong in [&[4, 99][..], &[-1], &[99], &[99, 2, 2], &[99, 4, 4], &[99, 3], &[], &[0, -1, 0]] {
            assert_eq!(of(&sequence, wrong), None, "{wrong:?}");
        }
        assert_eq!(
            reshaped(&sequence, 4, Some(4), &sizes(&[4, 1, 4]), false),
            Some(vec![Batch, One, Values])
        );
        assert_eq!(
            reshaped(&[One, Values], 4, None, &sizes(&[1, 1, 4]), false),
            Some(vec![One, One, Values])
        );
        assert_eq!(reshaped(&[Batch, Values], 1, None, &sizes(&[-1]), false), Some(vec![Batch]));
    }
}
