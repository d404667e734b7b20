//! Assigns the same slot to values that are not needed at the same time, so that the slots fit the cache.

use super::steps::{FlatStep, Heads, LayerSteps, PlaneStep};

/// The slots that a step reads and writes.
trait Slots {
    fn inputs(&mut self) -> Vec<&mut usize>;
    fn output(&mut self) -> Option<&mut usize>;
}

impl Slots for PlaneStep {
    fn inputs(&mut self) -> Vec<&mut usize> {
        match self {
            Self::Convolve { input, added, .. } => std::iter::once(input).chain(added).collect(),
            Self::Activate { input, .. } | Self::Flatten { input, .. } => vec![input],
            Self::Add { inputs, .. } => inputs.iter_mut().collect(),
        }
    }

    fn output(&mut self) -> Option<&mut usize> {
        match self {
            Self::Convolve { output, .. } | Self::Activate { output, .. } | Self::Add { output, .. } => {
                Some(output)
            }
            Self::Flatten { .. } => None,
        }
    }
}

impl Slots for FlatStep {
    fn inputs(&mut self) -> Vec<&mut usize> {
        match self {
            Self::Dense { input, .. } | Self::Activate { input, .. } | Self::Gru { input, .. } => vec![input],
            Self::Add { inputs, .. } | Self::Join { inputs, .. } => inputs.iter_mut().collect(),
            Self::Scalars { .. } => Vec::new(),
        }
    }

    fn output(&mut self) -> Option<&mut usize> {
        match self {
            Self::Dense { output, .. }
            | Self::Activate { output, .. }
            | Self::Add { output, .. }
            | Self::Gru { output, .. }
            | Self::Scalars { output }
            | Self::Join { output, .. } => Some(output),
        }
    }
}

/// Renumbers the slots of all steps.
pub fn share(steps: &mut LayerSteps, heads: &mut Heads) {
    // These lists share no slot: `flatten` writes its list before the first step on lists, and the heads read theirs
    // after the last.
    let mut kept = vec![heads.input];
    kept.extend(steps.of_planes.iter().filter_map(|step| match step {
        PlaneStep::Flatten { output, .. } => Some(*output),
        _ => None,
    }));
    share_slots(&mut steps.of_planes, &mut steps.planes, &[0]);
    let flats = share_slots(&mut steps.of_flats, &mut steps.flats, &kept);
    heads.input = flats[heads.input];
    for step in &mut steps.of_planes {
        if let PlaneStep::Flatten { output, .. } = step {
            *output = flats[*output];
        }
    }
}

/// Returns the new number of each slot. Only values of the same shape share a slot; those in `kept` share none.
fn share_slots<S: Slots, T: Clone + PartialEq>(
    steps: &mut [S],
    shapes: &mut Vec<T>,
    kept: &[usize],
) -> Vec<usize> {
    let mut last_use = vec![0; shapes.len()];
    for (index, step) in steps.iter_mut().enumerate() {
        step.inputs().into_iter().for_each(|slot| last_use[*slot] = index);
    }
    let mut new: Vec<usize> = vec![usize::MAX; shapes.len()];
    let (mut new_shapes, mut free) = (Vec::new(), Vec::<usize>::new());
    let mut allot = |slot: usize, free: &mut Vec<usize>| {
        let found = free.iter().position(|free| new_shapes[*free] == shapes[slot] && !kept.contains(&slot));
        found.map_or_else(
            || {
                new_shapes.push(shapes[slot].clone());
                new_shapes.len() - 1
            },
            |index| free.swap_remove(index),
        )
    };
    for slot in kept {
        // The list of `flatten` may also be the input of the heads.
        if new[*slot] != usize::MAX {
            continue;
        }
        new[*slot] = allot(*slot, &mut free);
    }
    for (index, step) in steps.iter_mut().enumerate() {
        if let Some(output) = step.output()
            && new[*output] == usize::MAX
        {
            new[*output] = allot(*output, &mut free);
        }
        if let Some(output) = step.output() {
            *output = new[*output];
        }
        let mut done: Vec<usize> = step.inputs().iter().map(|slot| **slot).collect();
        done.retain(|slot| last_use[*slot] == index && !kept.contains(slot));
        done.dedup();
        free.extend(done.iter().map(|slot| new[*slot]));
        step.inputs().into_iter().for_each(|slot| *slot = new[*slot]);
    }
    *shapes = new_shapes;
    new
}
