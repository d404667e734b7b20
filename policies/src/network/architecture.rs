//! The layers of a network, as its JSON lists them.

use serde::{Deserialize, Serialize};

/// The layers of a network and the names of their tensors.
///
/// The JSON holds no sizes except those of the input: the shapes of the tensors determine all others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Architecture {
    /// Channels, rows and columns of the window.
    pub window: [usize; 3],
    /// Number of scalars, which the network reads beside the window.
    #[serde(default)]
    pub scalars: usize,
    /// The layers in order, from the window to the input of the heads.
    pub layers: Vec<Layer>,
    /// The prefix of the tensors of the dense layer that returns the logits.
    pub actions: String,
    /// The prefix of the tensors of the dense layer that returns the value, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<String>,
}

/// One layer. Its name is the prefix of its tensors' names, as in a PyTorch `state_dict`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum Layer {
    /// A convolution with stride 1, of `NAME.weight` (outputs, inputs, rows, columns) and `NAME.bias`.
    Convolution {
        /// The prefix of the tensors' names.
        name: String,
        /// Number of rows and columns of zeros around the input.
        padding: usize,
    },
    /// A dense layer, of `NAME.weight` (outputs, inputs) and `NAME.bias`.
    Dense(String),
    /// The larger of a value and 0.
    Relu,
    /// The value itself if it is positive, else exp(value) - 1.
    Elu,
    /// Layers whose output is added to their input. If a ReLU precedes the block, the sum contains the output of the
    /// ReLU, as in a PyTorch block whose first ReLU is in place. If the first layer of the block is a ReLU, the sum
    /// contains the input of that ReLU.
    Residual(Vec<Layer>),
    /// Joins channels, rows and columns into one list, in this order.
    Flatten,
    /// Passes the scalars through these layers, and appends the result.
    Scalars(Vec<Layer>),
    /// A recurrent layer, of `NAME.weight_ih_l0`, `NAME.weight_hh_l0`, `NAME.bias_ih_l0` and `NAME.bias_hh_l0`: the
    /// gates reset, update and new, as in PyTorch.
    Gru(String),
}
