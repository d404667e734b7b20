//! Turns an architecture and its tensors into steps.

use pogema_core::{counted, rows_and_columns};

use super::architecture::{Architecture, Layer};
use super::gru::Gru;
use super::layers::{Activation, Convolution, Dense, Flat, Piece};
use super::slots;
use super::steps::{FlatStep, Heads, LayerSteps, PlaneStep};
use super::tensors::Tensors;
use crate::simd::Plane;

/// The largest number of values that the layers hold at once for an agent, margins and padding included. A thread has
/// buffers for the windows of 25 agents and for the lists of 36.
const MAX_VALUES: usize = 1 << 22;

/// The largest depth of nested layers, so that they cannot exhaust the stack.
const MAX_DEPTH: usize = 16;

/// Builds the steps of a network. Errors are messages that name the layer or the tensor.
pub fn build(architecture: &Architecture, tensors: &mut Tensors) -> Result<(LayerSteps, Heads), String> {
    let [channels, rows, cols] = architecture.window;
    if architecture.scalars > MAX_VALUES {
        return Err(format!("`scalars` is {}, expected at most {MAX_VALUES}", architecture.scalars));
    }
    let margin = margin_of(&architecture.layers, 0)?;
    let plane = Plane { rows, cols, channels, stride: channels, margin: 0 };
    check_size(&plane, "the window")?;
    let plane = Plane { margin, ..plane };
    check_size(&plane, "").map_err(|_| {
        let size = rows_and_columns(rows, cols);
        format!(
            "padding {margin} around the window of {size} is too wide, expected at most {MAX_VALUES} values"
        )
    })?;
    let steps = LayerSteps { num_scalars: architecture.scalars, ..LayerSteps::default() };
    let mut builder = Builder { tensors, steps, margin, held: Vec::new() };
    let input = builder.new_plane(plane);
    let last = builder.add_layers(&architecture.layers, Value::Plane(input))?;
    let Value::Flat(last) = last else {
        return Err("the layers end with a window, expected `flatten` before the heads".into());
    };
    let flat = &builder.steps.flats[last];
    let value = architecture.value.as_deref();
    let (dense, num_actions) =
        Dense::take_heads(builder.tensors, &architecture.actions, value, &flat.pieces)?;
    builder.tensors.check_all_taken()?;
    let (mut steps, mut heads) = (builder.steps, Heads { dense, input: last, num_actions });
    slots::share(&mut steps, &mut heads);
    let num_values = steps.num_values();
    if num_values > MAX_VALUES {
        return Err(format!("the layers hold {num_values} values at once, expected at most {MAX_VALUES}"));
    }
    Ok((steps, heads))
}

/// Checks that a network of these layers can be built. Errors are as for [`build`].
#[cfg(feature = "onnx")]
pub fn check_layers(architecture: &Architecture, tensors: &mut Tensors) -> Result<(), String> {
    build(architecture, tensors).map(|_| ())
}

/// Returns the widest padding of any convolution, which is the margin of all planes.
fn margin_of(layers: &[Layer], depth: usize) -> Result<usize, String> {
    if depth > MAX_DEPTH {
        return Err(format!("the layers are nested more than {MAX_DEPTH} deep"));
    }
    let mut widest = 0;
    for layer in layers {
        widest = widest.max(match layer {
            Layer::Convolution { padding, .. } => *padding,
            Layer::Residual(layers) | Layer::Scalars(layers) => margin_of(layers, depth + 1)?,
            _ => 0,
        });
    }
    Ok(widest)
}

fn check_size(plane: &Plane, what: &str) -> Result<(), String> {
    let cols = plane.margin.checked_mul(2).and_then(|margins| margins.checked_add(plane.cols));
    let pixels = cols.and_then(|cols| cols.checked_mul(plane.rows));
    let values = pixels.and_then(|pixels| pixels.checked_mul(plane.stride));
    if values.is_some_and(|values| (1..=MAX_VALUES).contains(&values)) && plane.cols > 0 {
        return Ok(());
    }
    let channels = counted(plane.channels, "channel");
    let size = rows_and_columns(plane.rows, plane.cols);
    Err(format!("{what} has {channels}, {size}, expected 1 to {MAX_VALUES} values"))
}

/// A value of an agent: a window or a list, by its slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Value {
    Plane(usize),
    Flat(usize),
}

struct Builder<'a> {
    tensors: &'a mut Tensors,
    steps: LayerSteps,
    margin: usize,
    /// Values that a later layer still needs.
    held: Vec<Value>,
}

impl Builder<'_> {
    fn add_layers(&mut self, layers: &[Layer], mut value: Value) -> Result<Value, String> {
        for layer in layers {
            value = self.add(layer, value)?;
        }
        Ok(value)
    }

    fn add(&mut self, layer: &Layer, value: Value) -> Result<Value, String> {
        match (layer, value) {
            (Layer::Convolution { name, padding }, Value::Plane(input)) => {
                self.convolve(name, *padding, input)
            }
            (Layer::Dense(name), Value::Flat(input)) => self.dense(name, input),
            (Layer::Gru(name), Value::Flat(input)) => self.gru(name, input),
            (Layer::Relu, _) => Ok(self.activate(Activation::Relu, value)),
            (Layer::Elu, _) => Ok(self.activate(Activation::Elu, value)),
            (Layer::Residual(layers), _) => self.residual(layers, value),
            (Layer::Flatten, Value::Plane(input)) => Ok(self.flatten(input)),
            (Layer::Scalars(layers), Value::Flat(input)) => self.scalars(layers, input),
            (Layer::Flatten, Value::Flat(_)) => {
                Err("layer `flatten` follows a list, expected a window".into())
            }
            (Layer::Convolution { name, .. }, Value::Flat(_)) => Err(format!(
                "layer `{name}` is a convolution of a list, expected a convolution before `flatten`"
            )),
            (Layer::Dense(name) | Layer::Gru(name), Value::Plane(_)) => {
                Err(format!("layer `{name}` has a window as input, expected `flatten` before it"))
            }
            (Layer::Scalars(_), Value::Plane(_)) => {
                Err("layer `scalars` has a window as input, expected `flatten` before it".into())
            }
        }
    }

    fn convolve(&mut self, name: &str, padding: usize, input: usize) -> Result<Value, String> {
        let convolution = Convolution::take(self.tensors, name, padding, self.steps.planes[input])?;
        check_size(&convolution.shape.output, &format!("the output of layer `{name}`"))?;
        let output = self.new_plane(convolution.shape.output);
        let step = PlaneStep::Convolve { convolution, input, added: None, relu: false, output };
        self.steps.of_planes.push(step);
        Ok(Value::Plane(output))
    }

    fn dense(&mut self, name: &str, input: usize) -> Result<Value, String> {
        let names = [format!("{name}.weight"), format!("{name}.bias")];
        let pieces = &self.steps.flats[input].pieces;
        let dense = Dense::take(self.tensors, [&names[0], &names[1]], pieces)?;
        let output = self.new_flat(vec![Piece { pixels: 1, channels: dense.num_outputs }]);
        self.steps.of_flats.push(FlatStep::Dense { dense, input, relu: false, output });
        Ok(Value::Flat(output))
    }

    fn gru(&mut self, name: &str, input: usize) -> Result<Value, String> {
        let gru = Gru::take(self.tensors, name, &self.steps.flats[input].pieces)?;
        let offset = self.steps.state_size;
        self.steps.state_size += gru.size;
        let output = self.new_flat(vec![Piece { pixels: 1, channels: gru.size }]);
        self.steps.of_flats.push(FlatStep::Gru { gru, input, offset, output });
        Ok(Value::Flat(output))
    }

    /// Applies a function to each value. If a convolution or dense layer made the value in the last step and no other
    /// layer needs it, a ReLU becomes part of that step.
    fn activate(&mut self, activation: Activation, value: Value) -> Value {
        let is_held = self.held.contains(&value);
        match value {
            Value::Plane(input) => {
                if let Some(PlaneStep::Convolve { relu: relu @ false, output, .. }) =
                    self.steps.of_planes.last_mut()
                    && !is_held
                    && *output == input
                    && activation == Activation::Relu
                {
                    *relu = true;
                    return value;
                }
                let output = self.new_plane(self.steps.planes[input]);
                self.steps.of_planes.push(PlaneStep::Activate { activation, input, output });
                Value::Plane(output)
            }
            Value::Flat(input) => {
                if let Some(FlatStep::Dense { relu: relu @ false, output, .. }) =
                    self.steps.of_flats.last_mut()
                    && !is_held
                    && *output == input
                    && activation == Activation::Relu
                {
                    *relu = true;
                    return value;
                }
                let output = self.new_flat(self.steps.flats[input].pieces.clone());
                self.steps.of_flats.push(FlatStep::Activate { activation, input, output });
                Value::Flat(output)
            }
        }
    }

    fn residual(&mut self, layers: &[Layer], input: Value) -> Result<Value, String> {
        self.held.push(input);
        let inner = self.add_layers(layers, input)?;
        self.held.pop();
        let differs = || {
            "layer `residual`: the shape that its layers return differs from the shape of their input"
                .to_owned()
        };
        match (input, inner) {
            (Value::Plane(input), Value::Plane(inner)) => {
                if self.steps.planes[input] != self.steps.planes[inner] {
                    let [one, other] = [input, inner].map(|slot| self.steps.planes[slot]);
                    let is_same = Plane { stride: other.stride, ..one } == other;
                    return Err(if is_same {
                        "layer `residual` begins with the window, expected a convolution before it".into()
                    } else {
                        differs()
                    });
                }
                if let Some(PlaneStep::Convolve { added: added @ None, relu: false, output, .. }) =
                    self.steps.of_planes.last_mut()
                    && *output == inner
                    && inner != input
                    && !self.held.contains(&Value::Plane(inner))
                {
                    *added = Some(input);
                    return Ok(Value::Plane(inner));
                }
                let output = self.new_plane(self.steps.planes[input]);
                self.steps.of_planes.push(PlaneStep::Add { inputs: [input, inner], output });
                Ok(Value::Plane(output))
            }
            (Value::Flat(input), Value::Flat(inner)) => {
                let [one, other] = [input, inner].map(|slot| &self.steps.flats[slot]);
                if one.len() != other.len() {
                    return Err(differs());
                }
                if one != other {
                    // The kernels store a flattened window in channels-last order, but the output of a dense layer in
                    // the order of PyTorch.
                    let reason = "layer `residual`: one side of the sum contains a flattened window and the other does \
                                  not, expected `dense` between `flatten` and the sum";
                    return Err(reason.into());
                }
                let output = self.new_flat(self.steps.flats[input].pieces.clone());
                self.steps.of_flats.push(FlatStep::Add { inputs: [input, inner], output });
                Ok(Value::Flat(output))
            }
            _ => Err(differs()),
        }
    }

    fn flatten(&mut self, input: usize) -> Value {
        let Plane { rows, cols, channels, .. } = self.steps.planes[input];
        let output = self.new_flat(vec![Piece { pixels: rows * cols, channels }]);
        self.steps.of_planes.push(PlaneStep::Flatten { input, output });
        Value::Flat(output)
    }

    fn scalars(&mut self, layers: &[Layer], input: usize) -> Result<Value, String> {
        if self.steps.num_scalars == 0 {
            return Err("layer `scalars` has no input, expected `scalars` above 0 in the architecture".into());
        }
        self.held.push(Value::Flat(input));
        let scalars = self.new_flat(vec![Piece { pixels: 1, channels: self.steps.num_scalars }]);
        self.steps.of_flats.push(FlatStep::Scalars { output: scalars });
        let scalars = self.add_layers(layers, Value::Flat(scalars))?;
        self.held.pop();
        let Value::Flat(scalars) = scalars else { unreachable!("no layer makes a window of a list") };
        let pieces = [input, scalars].map(|slot| self.steps.flats[slot].pieces.clone()).concat();
        let output = self.new_flat(pieces);
        self.steps.of_flats.push(FlatStep::Join { inputs: [input, scalars], output });
        Ok(Value::Flat(output))
    }

    fn new_plane(&mut self, plane: Plane) -> usize {
        debug_assert_eq!(plane.margin, self.margin);
        self.steps.planes.push(plane);
        self.steps.planes.len() - 1
    }

    fn new_flat(&mut self, pieces: Vec<Piece>) -> usize {
        self.steps.flats.push(Flat::new(pieces));
        self.steps.flats.len() - 1
    }
}
