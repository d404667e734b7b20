//! Follows the values of a graph from its inputs to its logits, as chains of layers.

use std::collections::HashMap;

use pogema_core::counted;

use super::axes::{Axis, Size};
use super::proto::{Graph, Node, TensorProto, ValueInfo};
use crate::network::{Architecture, Layer, Tensors};

/// The largest number of operators of a graph.
const MAX_NODES: usize = 2000;

/// The origin of a value.
#[derive(Clone, Debug)]
pub enum Value<'a> {
    /// A constant.
    Constant(&'a TensorProto),
    /// The output of a step, and its axes if it is a list.
    Step(usize, Vec<Axis>),
    /// The output of a matrix product whose bias has not been read yet: the step before it, the axes, and the weights,
    /// one row for each input feature.
    Product { input: usize, axes: Vec<Axis>, weights: &'a TensorProto },
    /// Sizes that are computed from those of other values.
    Sizes(Vec<Size>),
    /// Zeros, or an input that is neither the window nor scalars: possibly the state of a recurrent layer at the
    /// beginning of an episode. The text names this value.
    State(String),
    /// A value that depends on something that is not a layer. The text names what the value depends on.
    Unknown(String),
}

/// The shape of a value of an agent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    Window([usize; 3]),
    List(usize),
}

/// The name, the shape and the values of a tensor.
pub type NamedTensor = (String, Vec<usize>, Vec<f32>);

/// A layer and the step before it.
#[derive(Debug)]
pub struct Step {
    /// `None` for an input of the graph.
    pub before: Option<usize>,
    pub layer: Option<Layer>,
    pub shape: Shape,
}

/// Reads a graph node by node. Nodes of a graph are in topological order.
pub struct Reader<'a> {
    pub values: HashMap<&'a str, Value<'a>>,
    pub steps: Vec<Step>,
    /// The tensors of each layer, by the name of the layer.
    pub tensors: HashMap<String, Vec<NamedTensor>>,
    window: usize,
    /// The size of the batch, if the graph fixes it.
    pub batch: Option<i64>,
    /// The step of the scalars.
    pub scalars: Option<usize>,
}

impl<'a> Reader<'a> {
    pub fn new(graph: &'a Graph) -> Result<Self, String> {
        if graph.node.len() > MAX_NODES {
            return Err(format!("{} operators, expected at most {MAX_NODES}", graph.node.len()));
        }
        let constants = graph.initializer.iter().map(|tensor| (&*tensor.name, Value::Constant(tensor)));
        let mut reader = Self {
            values: constants.collect(),
            steps: Vec::new(),
            tensors: HashMap::new(),
            window: 0,
            batch: None,
            scalars: None,
        };
        // Old files list their tensors among the inputs.
        let inputs = graph.input.iter().filter(|input| !reader.values.contains_key(&*input.name));
        let inputs: Vec<_> = inputs.map(|input| (input, sizes(input))).collect();
        let window = inputs.iter().find_map(|(_, sizes)| sizes.as_ref().filter(|sizes| sizes.len() == 4));
        reader.batch = window.filter(|sizes| sizes[0] > 0).and_then(|sizes| i64::try_from(sizes[0]).ok());
        let mut windows = 0;
        for (input, sizes) in inputs {
            let shape = match sizes.as_deref() {
                Some(sizes @ [_, channels, rows, cols]) => {
                    if sizes[1..].contains(&0) {
                        return Err(format!(
                            "input `{}` has dynamic channels, rows or columns, expected fixed sizes; only the first \
                             dimension may be dynamic",
                            input.name
                        ));
                    }
                    Shape::Window([*channels, *rows, *cols])
                }
                Some([_, len]) => Shape::List(*len),
                _ => {
                    let reason = format!(
                        "input `{}`, whose shape is neither (batch, channels, rows, columns) nor (batch, numbers)",
                        input.name
                    );
                    reader.values.insert(&input.name, Value::State(reason));
                    continue;
                }
            };
            let step = reader.push(Step { before: None, layer: None, shape });
            let value = reader.output(step);
            reader.values.insert(&input.name, value);
            if let Shape::Window(_) = shape {
                windows += 1;
                reader.window = step;
            }
        }
        if windows == 1 {
            return Ok(reader);
        }
        Err(format!("{} of shape (batch, channels, rows, columns), expected one", counted(windows, "input")))
    }

    /// Returns the shape of the window.
    pub fn window(&self) -> [usize; 3] {
        match self.steps[self.window].shape {
            Shape::Window(window) => window,
            Shape::List(_) => unreachable!("`new` checked that the input is a window"),
        }
    }

    pub fn push(&mut self, step: Step) -> usize {
        self.steps.push(step);
        self.steps.len() - 1
    }

    /// Returns the axis of the batch.
    pub fn batch_axis(&self) -> Axis {
        if self.batch == Some(1) { Axis::One } else { Axis::Batch }
    }

    /// Returns the output of a step, with the axis of the batch first.
    pub fn output(&self, step: usize) -> Value<'a> {
        let axes = match self.steps[step].shape {
            Shape::Window(_) => Vec::new(),
            Shape::List(_) => vec![self.batch_axis(), Axis::Values],
        };
        Value::Step(step, axes)
    }

    /// Appends a layer to a step.
    pub fn append(&mut self, before: usize, layer: Layer, shape: Shape) -> usize {
        self.push(Step { before: Some(before), layer: Some(layer), shape })
    }

    /// Reads a node. Its outputs are unknown if the operator is not supported.
    pub fn add(&mut self, node: &'a Node) {
        let value = self.operator(node).unwrap_or_else(|reason| {
            let operator = &node.op_type;
            Value::Unknown(if reason.is_empty() { format!("operator `{operator}`") } else { reason })
        });
        for (index, name) in node.output.iter().enumerate() {
            let value = match (index, &value) {
                (0, _) | (_, Value::Unknown(_)) => value.clone(),
                // The second output has no axis for time.
                (1, Value::Step(step, axes)) if node.op_type == "GRU" => {
                    Value::Step(*step, axes[1..].to_vec())
                }
                _ => Value::Unknown(format!("output {index} of operator `{}`", node.op_type)),
            };
            self.values.insert(name, value);
        }
    }

    /// Returns the layers from one step to another, or `None` if the second does not follow the first.
    pub fn layers_between(&self, first: usize, last: usize) -> Option<Vec<Layer>> {
        let mut layers = Vec::new();
        let mut at = last;
        while at != first {
            layers.extend(self.steps[at].layer.clone());
            at = self.steps[at].before?;
        }
        layers.reverse();
        Some(layers)
    }

    /// Returns the architecture whose heads return these outputs, and its tensors. The value is left out unless its
    /// head is a dense layer that reads the same step as the head of the logits.
    pub fn finish(
        &mut self,
        logits: &'a str,
        value: Option<&'a str>,
    ) -> Result<(Architecture, Tensors), String> {
        let (last, actions) = self.head(logits)?;
        let value = value.and_then(|value| self.head(value).ok()).filter(|(step, _)| *step == last);
        let value = value.map(|(_, name)| name);
        let layers =
            self.layers_between(self.window, last).ok_or("the logits do not depend on the window")?;
        let scalars = match self.scalars.map(|step| self.steps[step].shape) {
            Some(Shape::List(len)) if has_scalars(&layers) => len,
            _ => 0,
        };
        let mut tensors = Tensors::default();
        let heads = [Some(&actions), value.as_ref()];
        let mut names: Vec<String> = heads.into_iter().flatten().cloned().collect();
        collect_names(&layers, &mut names);
        for name in names {
            for (name, shape, values) in self.tensors.remove(&name).into_iter().flatten() {
                tensors.insert_values(&name, shape, values)?;
            }
        }
        Ok((Architecture { window: self.window(), scalars, layers, actions, value }, tensors))
    }

    /// Returns the step before the dense layer that computes an output, and the name of that layer.
    fn head(&mut self, output: &'a str) -> Result<(usize, String), String> {
        if let Some(value) = self.values.get(output).cloned() {
            let value = self.with_bias(value)?;
            self.values.insert(output, value);
        }
        match self.values.get(output) {
            Some(Value::Step(step, _)) => match &self.steps[*step] {
                Step { before: Some(before), layer: Some(Layer::Dense(name)), .. } => {
                    Ok((*before, name.clone()))
                }
                _ => Err(format!("output `{output}` does not come from a dense layer")),
            },
            Some(Value::Unknown(reason) | Value::State(reason)) => {
                Err(format!("output `{output}` depends on something other than a supported layer: {reason}"))
            }
            _ => Err(format!("output `{output}` depends on no input")),
        }
    }
}

/// Returns the sizes of an input, 0 for open ones, or `None` if its shape is unknown.
fn sizes(input: &ValueInfo) -> Option<Vec<usize>> {
    let shape = input.r#type.as_ref()?.tensor_type.as_ref()?.shape.as_ref()?;
    shape.dim.iter().map(|size| usize::try_from(size.dim_value).ok()).collect()
}

fn has_scalars(layers: &[Layer]) -> bool {
    layers.iter().any(|layer| match layer {
        Layer::Scalars(_) => true,
        Layer::Residual(layers) => has_scalars(layers),
        _ => false,
    })
}

fn collect_names(layers: &[Layer], names: &mut Vec<String>) {
    for layer in layers {
        match layer {
            Layer::Convolution { name, .. } | Layer::Dense(name) | Layer::Gru(name) => {
                names.push(name.clone());
            }
            Layer::Residual(layers) | Layer::Scalars(layers) => collect_names(layers, names),
            Layer::Relu | Layer::Elu | Layer::Flatten => {}
        }
    }
}
