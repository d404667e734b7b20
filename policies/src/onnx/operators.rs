//! Reads the operators of a graph as layers. An error names what is not supported; an empty text stands for the
//! operator itself.

use super::axes::{self, Axis};
use super::graph::{Reader, Shape, Value};
use super::proto::{Node, TensorProto};
use crate::network::Layer;

impl<'a> Reader<'a> {
    /// Returns the first output of a node.
    pub fn operator(&mut self, node: &'a Node) -> Result<Value<'a>, String> {
        if !matches!(&*node.domain, "" | "ai.onnx") {
            return Err(String::new());
        }
        if let Some(value) = self.unchanged(node) {
            return Ok(value);
        }
        match &*node.op_type {
            "Constant" => node.tensor("value").map(Value::Constant).ok_or_else(String::new),
            "Identity" | "Dropout" => self.value(node, 0),
            "Relu" => self.activation(node, Layer::Relu),
            "Elu" if node.float("alpha", 1.0) == 1.0 => self.activation(node, Layer::Elu),
            "Conv" => self.convolution(node),
            "Add" => self.add_values(node),
            "Flatten" => self.flatten(node),
            "Reshape" => self.reshape(node),
            "Gemm" => self.gemm(node),
            "MatMul" => self.product(node),
            "Concat" => self.concat(node),
            "Squeeze" | "Unsqueeze" | "Transpose" | "Gather" | "Slice" => self.move_axes(node),
            "Shape" => self.sizes(node),
            "Mul" => self.multiply_sizes(node),
            "GRU" => self.gru(node),
            _ => Err(String::new()),
        }
    }

    /// Returns an input of a node.
    pub fn value(&self, node: &Node, index: usize) -> Result<Value<'a>, String> {
        let name = node.input.get(index).ok_or_else(String::new)?;
        match self.values.get(&**name) {
            Some(Value::Unknown(reason)) => Err(reason.clone()),
            Some(value) => Ok(value.clone()),
            None => Err(format!("value `{name}`, which no earlier operator returns")),
        }
    }

    /// Returns a value; a product without a bias becomes a dense layer whose bias is zero.
    pub fn with_bias(&mut self, value: Value<'a>) -> Result<Value<'a>, String> {
        let Value::Product { input, axes, weights } = value else { return Ok(value) };
        let (sizes, values) = weights.floats()?;
        let [inputs, outputs] = sizes[..] else { return Err(String::new()) };
        let values = transposed(&values, [inputs, outputs]);
        let step = self.dense(input, weights, [outputs, inputs], (values, vec![0.0; outputs]));
        Ok(Value::Step(step, axes))
    }

    /// Returns the step that is an input of a node, its shape and its axes. A product without a bias gets a zero bias.
    pub fn step(&mut self, node: &'a Node, index: usize) -> Result<(usize, Shape, Vec<Axis>), String> {
        let value = self.value(node, index)?;
        let value = self.with_bias(value)?;
        self.values.insert(&node.input[index], value.clone());
        match value {
            Value::Step(step, axes) => Ok((step, self.steps[step].shape, axes)),
            Value::State(reason) => Err(reason),
            _ => Err(String::new()),
        }
    }

    /// Returns an input that is a list whose first axis is that of the batch.
    fn list(&mut self, node: &'a Node) -> Result<(usize, usize), String> {
        let (step, shape, axes) = self.step(node, 0)?;
        match shape {
            Shape::List(len) if axes == [self.batch_axis(), Axis::Values] => Ok((step, len)),
            _ => Err(String::new()),
        }
    }

    pub fn constant(&self, node: &Node, index: usize) -> Result<&'a TensorProto, String> {
        match self.value(node, index)? {
            Value::Constant(tensor) => Ok(tensor),
            _ => Err(format!("operator `{}` whose input {index} is not a constant", node.op_type)),
        }
    }

    fn activation(&mut self, node: &'a Node, layer: Layer) -> Result<Value<'a>, String> {
        let (input, shape, axes) = self.step(node, 0)?;
        Ok(Value::Step(self.append(input, layer, shape), axes))
    }

    /// Stores the tensors of a layer and returns the layer's name: that of its weights without `.weight`. If this
    /// ending is missing or another layer has this name, returns `layer-NUMBER`.
    fn store(&mut self, weights: &TensorProto, tensors: Vec<(&str, Vec<usize>, Vec<f32>)>) -> String {
        let own = weights.name.strip_suffix(".weight").filter(|name| !self.tensors.contains_key(*name));
        let mut number = self.tensors.len();
        // A file may itself call its tensors `layer-NUMBER`.
        while self.tensors.contains_key(&format!("layer-{number}")) {
            number += 1;
        }
        let name = own.map_or_else(|| format!("layer-{number}"), str::to_owned);
        let named = tensors.into_iter().map(|(end, shape, values)| (format!("{name}.{end}"), shape, values));
        self.tensors.insert(name.clone(), named.collect());
        name
    }

    fn convolution(&mut self, node: &'a Node) -> Result<Value<'a>, String> {
        let (input, shape, _) = self.step(node, 0)?;
        let weights = self.constant(node, 1)?;
        let (sizes, values) = weights.floats()?;
        let ([outputs, _, height, width], Shape::Window([_, rows, cols])) = (&*sizes, shape) else {
            return Err(String::new());
        };
        let all = |name: &str, value: i64| node.ints(name).iter().all(|size| *size == value);
        let padding = node.ints("pads").first().copied().unwrap_or(0);
        if !all("pads", padding)
            || !all("strides", 1)
            || !all("dilations", 1)
            || node.int("group", 1) != 1
            || !node.is_text("auto_pad", "NOTSET")
        {
            return Err("operator `Conv` with strides, dilations, groups or unequal padding".into());
        }
        let padding = usize::try_from(padding).map_err(|_| "operator `Conv` with negative padding")?;
        let size = |input: usize, kernel: &usize| {
            padding.checked_mul(2)?.checked_add(input)?.checked_add(1)?.checked_sub(*kernel)
        };
        let (Some(rows), Some(cols)) = (size(rows, height), size(cols, width)) else {
            return Err(String::new());
        };
        let bias = self.bias(node, *outputs)?;
        let outputs = *outputs;
        let name = self.store(weights, vec![("weight", sizes, values), ("bias", vec![outputs], bias)]);
        let layer = Layer::Convolution { name, padding };
        let step = self.append(input, layer, Shape::Window([outputs, rows, cols]));
        Ok(self.output(step))
    }

    /// Returns the bias that is the third input of a node, zeros if there is none.
    fn bias(&self, node: &Node, outputs: usize) -> Result<Vec<f32>, String> {
        if node.input.get(2).is_none_or(String::is_empty) {
            return Ok(vec![0.0; outputs]);
        }
        Ok(self.constant(node, 2)?.floats()?.1)
    }

    /// Returns whether an input of a node can be the state at the beginning of an episode: whether it is absent, zeros,
    /// or an input of the graph.
    fn is_first_state(&self, node: &Node, index: usize) -> bool {
        let Some(name) = node.input.get(index).filter(|name| !name.is_empty()) else { return true };
        match self.values.get(&**name) {
            Some(Value::Constant(tensor)) => is_zero(tensor),
            Some(Value::State(_)) => true,
            Some(Value::Step(step, _)) => {
                let is_list = matches!(self.steps[*step].shape, Shape::List(_));
                is_list && self.steps[*step].before.is_none() && self.scalars != Some(*step)
            }
            _ => false,
        }
    }

    fn gemm(&mut self, node: &'a Node) -> Result<Value<'a>, String> {
        let (input, _) = self.list(node)?;
        let weights = self.constant(node, 1)?;
        let (sizes, mut values) = weights.floats()?;
        let [first, second] = &*sizes else { return Err(String::new()) };
        if node.float("alpha", 1.0) != 1.0 || node.float("beta", 1.0) != 1.0 || node.int("transA", 0) != 0 {
            return Err("operator `Gemm` with a factor or a transposed input".into());
        }
        let (mut outputs, mut inputs) = (*first, *second);
        if node.int("transB", 0) == 0 {
            values = transposed(&values, [*first, *second]);
            (inputs, outputs) = (*first, *second);
        }
        let bias = self.bias(node, outputs)?;
        let step = self.dense(input, weights, [outputs, inputs], (values, bias));
        Ok(self.output(step))
    }

    fn dense(
        &mut self,
        input: usize,
        weights: &TensorProto,
        sizes: [usize; 2],
        (values, bias): (Vec<f32>, Vec<f32>),
    ) -> usize {
        let name =
            self.store(weights, vec![("weight", sizes.into(), values), ("bias", vec![sizes[0]], bias)]);
        self.append(input, Layer::Dense(name), Shape::List(sizes[0]))
    }

    fn product(&mut self, node: &'a Node) -> Result<Value<'a>, String> {
        let (input, _, axes) = self.step(node, 0)?;
        let weights = self.constant(node, 1)?;
        match (axes.last(), &*weights.dims) {
            (Some(Axis::Values), [_, _]) => Ok(Value::Product { input, axes, weights }),
            _ => Err(String::new()),
        }
    }

    /// Reads the sum of a product and its bias, or of a value and another value that layers compute from it.
    fn add_values(&mut self, node: &'a Node) -> Result<Value<'a>, String> {
        match [self.value(node, 0)?, self.value(node, 1)?] {
            [Value::Product { input, axes, weights }, Value::Constant(bias)]
            | [Value::Constant(bias), Value::Product { input, axes, weights }] => {
                let ((sizes, values), bias) = (weights.floats()?, bias.floats()?.1);
                let [inputs, outputs] = sizes[..] else { return Err(String::new()) };
                let values = transposed(&values, [inputs, outputs]);
                Ok(Value::Step(self.dense(input, weights, [outputs, inputs], (values, bias)), axes))
            }
            _ => {
                let ((one, shape, axes), (other, other_shape, other_axes)) =
                    (self.step(node, 0)?, self.step(node, 1)?);
                if (shape, &axes) != (other_shape, &other_axes) {
                    return Err(String::new());
                }
                // Only the value that was read later can be computed from the other.
                let (first, last) = (one.min(other), one.max(other));
                let layers = self.layers_between(first, last);
                let layers = layers
                    .ok_or("operator `Add` of two values, neither of which is computed from the other")?;
                Ok(Value::Step(self.append(first, Layer::Residual(layers), shape), axes))
            }
        }
    }

    /// Reads a list to which the scalars are appended.
    fn concat(&mut self, node: &'a Node) -> Result<Value<'a>, String> {
        if let Some(sizes) = self.concat_sizes(node) {
            return Ok(Value::Sizes(sizes));
        }
        let ((one, Shape::List(left), axes), (other, Shape::List(right), other_axes)) =
            (self.step(node, 0)?, self.step(node, 1)?)
        else {
            return Err(String::new());
        };
        let is_last = axes::index(node.int("axis", 0), axes.len()).map(|axis| axis + 1) == Some(axes.len());
        if node.input.len() != 2 || axes != other_axes || !is_last || !axes.ends_with(&[Axis::Values]) {
            return Err(String::new());
        }
        let mut input = other;
        while let Some(before) = self.steps[input].before {
            input = before;
        }
        let layers = self.layers_between(input, other).unwrap_or_default();
        if matches!(self.steps[input].shape, Shape::Window(_))
            || self.scalars.is_some_and(|known| known != input)
        {
            return Err("operator `Concat` whose second input does not come from the scalars".into());
        }
        self.scalars = Some(input);
        let len = left.checked_add(right).ok_or_else(String::new)?;
        Ok(Value::Step(self.append(one, Layer::Scalars(layers), Shape::List(len)), axes))
    }

    /// Reads a recurrent layer with PyTorch's formula. In ONNX, the gates are in the order update, reset, new.
    fn gru(&mut self, node: &'a Node) -> Result<Value<'a>, String> {
        let (input, _, axes) = self.step(node, 0)?;
        if axes != [Axis::One, self.batch_axis(), Axis::Values] {
            return Err("operator `GRU` whose input does not have the shape (1, batch, features)".into());
        }
        let weights = self.constant(node, 1)?;
        let ((of_input, input_values), (of_state, state_values)) =
            (weights.floats()?, self.constant(node, 2)?.floats()?);
        let ([1, rows, inputs], [1, state_rows, size]) = (&*of_input, &*of_state) else {
            return Err(String::new());
        };
        if rows != state_rows
            || Some(*rows) != size.checked_mul(3)
            || node.int("linear_before_reset", 0) != 1
            || node.int("layout", 0) != 0
            || !node.is_text("direction", "forward")
            || !node.has_texts("activations", &["Sigmoid", "Tanh"])
            || ["activation_alpha", "activation_beta", "clip"].iter().any(|name| node.has(name))
        {
            return Err("operator `GRU` that differs from PyTorch's".into());
        }
        if !self.is_first_state(node, 5) {
            return Err(
                "operator `GRU` whose initial state is neither zeros nor an input of the graph".into()
            );
        }
        let bias = match node.input.get(3) {
            Some(name) if !name.is_empty() => self.constant(node, 3)?.floats()?.1,
            _ => vec![0.0; 2 * rows],
        };
        if bias.len() != 2 * rows {
            return Err("operator `GRU` whose bias does not fit its weights".into());
        }
        let (rows, inputs, size) = (*rows, *inputs, *size);
        let (input_bias, state_bias) = bias.split_at(rows);
        let tensors = vec![
            ("weight_ih_l0", vec![rows, inputs], reset_first(&input_values)),
            ("weight_hh_l0", vec![rows, size], reset_first(&state_values)),
            ("bias_ih_l0", vec![rows], reset_first(input_bias)),
            ("bias_hh_l0", vec![rows], reset_first(state_bias)),
        ];
        let name = self.store(weights, tensors);
        let step = self.append(input, Layer::Gru(name), Shape::List(size));
        // The axes of time, direction, batch and values.
        Ok(Value::Step(step, vec![Axis::One, Axis::One, self.batch_axis(), Axis::Values]))
    }
}

pub fn is_zero(tensor: &TensorProto) -> bool {
    tensor.floats().is_ok_and(|(_, values)| values.iter().all(|value| *value == 0.0))
}

/// Swaps the first and the second third of a list.
fn reset_first(values: &[f32]) -> Vec<f32> {
    let third = values.len() / 3;
    [&values[third..2 * third], &values[..third], &values[2 * third..]].concat()
}

fn transposed(values: &[f32], [rows, cols]: [usize; 2]) -> Vec<f32> {
    (0..rows * cols).map(|index| values[index % rows * cols + index / rows]).collect()
}
