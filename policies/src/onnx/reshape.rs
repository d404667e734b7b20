//! The operators that change axes or sizes, but no value of an agent. They have no layer, except when they flatten a
//! window.

use super::axes::{self, Axis, Size};
use super::graph::{Reader, Shape, Value};
use super::operators::is_zero;
use super::proto::Node;
use crate::network::Layer;

impl<'a> Reader<'a> {
    /// Returns the output of an operator that changes no state and no sizes, or creates zeros.
    pub fn unchanged(&self, node: &Node) -> Option<Value<'a>> {
        let zeros = || Some(Value::State(format!("zeros of operator `{}`", node.op_type)));
        match (&*node.op_type, self.value(node, 0)) {
            ("ConstantOfShape", _) if node.tensor("value").is_none_or(is_zero) => zeros(),
            ("Expand", Ok(Value::Constant(tensor))) if is_zero(tensor) => zeros(),
            (
                "Identity" | "Squeeze" | "Unsqueeze" | "Transpose" | "Reshape" | "Slice" | "Gather"
                | "Expand",
                Ok(value @ Value::State(_)),
            )
            | ("Cast" | "Squeeze" | "Unsqueeze" | "Reshape", Ok(value @ Value::Sizes(_))) => Some(value),
            _ => None,
        }
    }

    /// Returns the integers of an input of a node, or `None` if it is absent.
    fn integers(&self, node: &Node, index: usize) -> Result<Option<Vec<i64>>, String> {
        if node.input.get(index).is_none_or(String::is_empty) {
            return Ok(None);
        }
        self.constant(node, index)?.integers().map(Some).ok_or_else(String::new)
    }

    /// Reads an operator that adds, removes or moves axes of lists, and changes no value; or one that selects sizes.
    pub fn move_axes(&mut self, node: &'a Node) -> Result<Value<'a>, String> {
        if let Value::Sizes(sizes) = self.value(node, 0)? {
            return self.select_sizes(node, &sizes).map(Value::Sizes).ok_or_else(String::new);
        }
        let (step, shape, axes) = self.step(node, 0)?;
        let Shape::List(len) = shape else { return Err(String::new()) };
        let is_one = |at: i64| axes::index(at, axes.len()).is_some_and(|at| axes[at] == Axis::One);
        let axes = match &*node.op_type {
            "Transpose" => axes::transposed(&axes, node.ints("perm")),
            // Selects the only entry of an axis. If the index is a scalar, `Gather` removes the axis.
            "Gather" => {
                let at = node.int("axis", 0);
                let entries = self.constant(node, 1)?;
                let is_first = matches!(entries.integers().as_deref(), Some([0 | -1])) && is_one(at);
                match &entries.dims[..] {
                    [] if is_first => axes::squeezed(&axes, Some(&[at]), len),
                    [1] if is_first => Some(axes),
                    _ => None,
                }
            }
            // Selects the whole of an axis that has one entry.
            "Slice" => {
                let at = self.integers(node, 3)?.unwrap_or_else(|| vec![0]);
                let (first, end) = (self.integers(node, 1)?, self.integers(node, 2)?);
                let is_whole = match (first.as_deref(), end.as_deref(), &at[..]) {
                    (Some([0 | -1]), Some([end]), [at]) => *end > 0 && is_one(*at),
                    _ => false,
                };
                is_whole.then_some(axes)
            }
            operator => {
                let at = self.integers(node, 1)?;
                // Old files have an attribute instead.
                let at = at.or_else(|| node.has("axes").then(|| node.ints("axes").to_vec()));
                match (operator, at) {
                    ("Squeeze", at) => axes::squeezed(&axes, at.as_deref(), len),
                    (_, Some(at)) => axes::unsqueezed(&axes, &at),
                    (_, None) => None,
                }
            }
        };
        axes.map(|axes| Value::Step(step, axes)).ok_or_else(String::new)
    }

    /// Reads the sizes of a value.
    pub fn sizes(&mut self, node: &'a Node) -> Result<Value<'a>, String> {
        let (step, shape, axes) = self.step(node, 0)?;
        let fixed = |size: usize| i64::try_from(size).map(Size::Fixed).map_err(|_| String::new());
        let batch = self.batch.map_or(Size::Batch, Size::Fixed);
        let len = self.num_values(step)?;
        let sizes = match shape {
            Shape::Window(window) => {
                let window = window.into_iter().map(fixed);
                std::iter::once(Ok(batch)).chain(window).collect::<Result<Vec<_>, _>>()?
            }
            Shape::List(_) => {
                let size = |axis: &Axis| match axis {
                    Axis::Batch => Ok(batch),
                    Axis::Values => fixed(len),
                    Axis::One => Ok(Size::Fixed(1)),
                };
                axes.iter().map(size).collect::<Result<_, _>>()?
            }
        };
        let (start, end) = (node.int("start", 0), node.has("end").then(|| node.int("end", 0)));
        axes::range(&sizes, start, end).map(Value::Sizes).ok_or_else(String::new)
    }

    /// Returns an input as sizes.
    fn as_sizes(&self, node: &Node, index: usize) -> Result<Vec<Size>, String> {
        match self.value(node, index)? {
            Value::Sizes(sizes) => Ok(sizes),
            Value::Constant(tensor) => tensor.integers().and_then(axes::sizes).ok_or_else(String::new),
            _ => Err(String::new()),
        }
    }

    fn select_sizes(&self, node: &Node, sizes: &[Size]) -> Option<Vec<Size>> {
        match &*node.op_type {
            "Gather" => {
                let entries =
                    self.constant(node, 1).ok()?.integers().filter(|entries| entries.len() <= sizes.len())?;
                entries.iter().map(|entry| Some(sizes[axes::index(*entry, sizes.len())?])).collect()
            }
            "Slice" => {
                let (first, end) = (self.integers(node, 1).ok()??, self.integers(node, 2).ok()??);
                let steps = self.integers(node, 4).ok()?;
                let (&[first], &[end], None | Some(&[1])) = (&first[..], &end[..], steps.as_deref()) else {
                    return None;
                };
                axes::range(sizes, first, Some(end))
            }
            _ => None,
        }
    }

    pub fn multiply_sizes(&self, node: &Node) -> Result<Value<'a>, String> {
        let (one, other) = (self.as_sizes(node, 0)?, self.as_sizes(node, 1)?);
        axes::product(&one, &other).map(Value::Sizes).ok_or_else(String::new)
    }

    /// Returns the joined sizes of all inputs, or `None` if an input does not consist of sizes.
    pub fn concat_sizes(&self, node: &Node) -> Option<Vec<Size>> {
        let sizes = (0..node.input.len()).map(|index| self.as_sizes(node, index).ok());
        axes::joined(&sizes.collect::<Option<Vec<_>>>()?)
    }

    pub fn flatten(&mut self, node: &'a Node) -> Result<Value<'a>, String> {
        let (input, shape, axes) = self.step(node, 0)?;
        let at = node.int("axis", 1);
        match shape {
            Shape::Window(_) if at == 1 => self.flattened(input),
            Shape::List(_) if axes::flattened(&axes, at) == Some([self.batch_axis(), Axis::Values]) => {
                Ok(self.output(input))
            }
            _ => Err(String::new()),
        }
    }

    /// Returns a window as a list.
    fn flattened(&mut self, window: usize) -> Result<Value<'a>, String> {
        let len = self.num_values(window)?;
        let step = self.append(window, Layer::Flatten, Shape::List(len));
        Ok(self.output(step))
    }

    /// Returns the number of values of an agent.
    fn num_values(&self, step: usize) -> Result<usize, String> {
        match self.steps[step].shape {
            Shape::Window(sizes) => {
                let num_values = sizes.iter().try_fold(1usize, |product, size| product.checked_mul(*size));
                num_values.ok_or_else(String::new)
            }
            Shape::List(len) => Ok(len),
        }
    }

    pub fn reshape(&mut self, node: &'a Node) -> Result<Value<'a>, String> {
        let (input, shape, axes) = self.step(node, 0)?;
        let sizes = self.as_sizes(node, 1)?;
        let (len, copies) = (self.num_values(input)?, node.int("allowzero", 0) == 0);
        // If the batch size is dynamic, files of older exporters flatten the batch to one list of fixed length.
        let is_list = self.batch.is_none_or(|batch| batch == 1)
            && matches!(&sizes[..], [Size::Fixed(0 | 1), size] if fits(*size, len));
        match shape {
            Shape::Window(_) => {
                let flat = [self.batch_axis(), Axis::Values];
                let is_flat =
                    axes::reshaped(&flat, len, self.batch, &sizes, copies).is_some_and(|axes| axes == flat);
                if is_list || is_flat { self.flattened(input) } else { Err(String::new()) }
            }
            Shape::List(_) if is_list && axes == [Axis::Batch, Axis::Values] => Ok(Value::Step(input, axes)),
            Shape::List(_) => {
                let axes = axes::reshaped(&axes, len, self.batch, &sizes, copies).ok_or_else(String::new)?;
                Ok(Value::Step(input, axes))
            }
        }
    }
}

/// Returns whether the last size of a reshape is, or is inferred as, the number of values of an agent.
fn fits(size: Size, len: usize) -> bool {
    matches!(size, Size::Fixed(size) if size == -1 || usize::try_from(size) == Ok(len))
}
