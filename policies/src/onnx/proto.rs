//! The parts of the messages of ONNX files that a network needs. Fields that are absent here are skipped. Lists of
//! numbers are written unpacked, as PyTorch writes them; packed lists are read, too.
//!
//! Source: <https://github.com/onnx/onnx/blob/main/onnx/onnx.proto3>

#![allow(missing_docs, reason = "the fields have the names of the source")]

use prost::Message;

use crate::network::{check_finite, check_num_values};

#[derive(Clone, PartialEq, Message)]
pub struct Model {
    #[prost(message, optional, tag = "7")]
    pub graph: Option<Graph>,
}

#[derive(Clone, PartialEq, Message)]
pub struct Graph {
    #[prost(message, repeated, tag = "1")]
    pub node: Vec<Node>,
    #[prost(message, repeated, tag = "5")]
    pub initializer: Vec<TensorProto>,
    #[prost(message, repeated, tag = "11")]
    pub input: Vec<ValueInfo>,
    #[prost(message, repeated, tag = "12")]
    pub output: Vec<ValueInfo>,
}

#[derive(Clone, PartialEq, Message)]
pub struct Node {
    #[prost(string, repeated, tag = "1")]
    pub input: Vec<String>,
    #[prost(string, repeated, tag = "2")]
    pub output: Vec<String>,
    #[prost(string, tag = "4")]
    pub op_type: String,
    #[prost(message, repeated, tag = "5")]
    pub attribute: Vec<Attribute>,
    #[prost(string, tag = "7")]
    pub domain: String,
}

#[derive(Clone, PartialEq, Message)]
pub struct Attribute {
    #[prost(string, tag = "1")]
    pub name: String,
    #[prost(float, tag = "2")]
    pub f: f32,
    #[prost(int64, tag = "3")]
    pub i: i64,
    #[prost(bytes = "vec", tag = "4")]
    pub s: Vec<u8>,
    #[prost(message, optional, tag = "5")]
    pub t: Option<TensorProto>,
    /// A subgraph; no supported layer has one.
    #[prost(bytes = "vec", optional, tag = "6")]
    pub g: Option<Vec<u8>>,
    #[prost(int64, repeated, packed = "false", tag = "8")]
    pub ints: Vec<i64>,
    #[prost(bytes = "vec", repeated, tag = "9")]
    pub strings: Vec<Vec<u8>>,
    #[prost(bytes = "vec", repeated, tag = "11")]
    pub graphs: Vec<Vec<u8>>,
}

#[derive(Clone, PartialEq, Message)]
pub struct TensorProto {
    #[prost(int64, repeated, packed = "false", tag = "1")]
    pub dims: Vec<i64>,
    #[prost(int32, tag = "2")]
    pub data_type: i32,
    #[prost(float, repeated, packed = "false", tag = "4")]
    pub float_data: Vec<f32>,
    #[prost(int64, repeated, packed = "false", tag = "7")]
    pub int64_data: Vec<i64>,
    #[prost(string, tag = "8")]
    pub name: String,
    #[prost(bytes = "vec", tag = "9")]
    pub raw_data: Vec<u8>,
    /// 1 if the data is in another file.
    #[prost(int32, tag = "14")]
    pub data_location: i32,
}

#[derive(Clone, PartialEq, Message)]
pub struct ValueInfo {
    #[prost(string, tag = "1")]
    pub name: String,
    #[prost(message, optional, tag = "2")]
    pub r#type: Option<Type>,
}

#[derive(Clone, PartialEq, Message)]
pub struct Type {
    #[prost(message, optional, tag = "1")]
    pub tensor_type: Option<TensorType>,
}

#[derive(Clone, PartialEq, Message)]
pub struct TensorType {
    #[prost(message, optional, tag = "2")]
    pub shape: Option<Shape>,
}

#[derive(Clone, PartialEq, Message)]
pub struct Shape {
    #[prost(message, repeated, tag = "1")]
    pub dim: Vec<Dimension>,
}

#[derive(Clone, PartialEq, Message)]
pub struct Dimension {
    /// 0 if the size is free.
    #[prost(int64, tag = "1")]
    pub dim_value: i64,
}

impl Node {
    fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.attribute.iter().find(|attribute| attribute.name == name)
    }

    /// Returns an attribute that is an integer, or the default if there is none.
    pub fn int(&self, name: &str, default: i64) -> i64 {
        self.attribute(name).map_or(default, |attribute| attribute.i)
    }

    /// Returns an attribute that is a float, or the default if there is none.
    pub fn float(&self, name: &str, default: f32) -> f32 {
        self.attribute(name).map_or(default, |attribute| attribute.f)
    }

    /// Returns an attribute that is a list of integers, empty if there is none.
    pub fn ints(&self, name: &str) -> &[i64] {
        self.attribute(name).map_or(&[], |attribute| &attribute.ints)
    }

    /// Returns whether an attribute is absent or has this text.
    pub fn is_text(&self, name: &str, text: &str) -> bool {
        self.attribute(name).is_none_or(|attribute| attribute.s == text.as_bytes())
    }

    /// Returns whether an attribute is absent or has these texts.
    pub fn has_texts(&self, name: &str, texts: &[&str]) -> bool {
        self.attribute(name).is_none_or(|attribute| {
            attribute.strings.iter().map(Vec::as_slice).eq(texts.iter().map(|text| text.as_bytes()))
        })
    }

    /// Returns whether an attribute is given.
    pub fn has(&self, name: &str) -> bool {
        self.attribute(name).is_some()
    }

    /// Returns an attribute that is a tensor.
    pub fn tensor(&self, name: &str) -> Option<&TensorProto> {
        self.attribute(name).and_then(|attribute| attribute.t.as_ref())
    }
}

impl TensorProto {
    const FLOAT: i32 = 1;
    const INT64: i32 = 7;

    /// Returns the shape and the values of a tensor of floats. Errors are messages without the path.
    pub fn floats(&self) -> Result<(Vec<usize>, Vec<f32>), String> {
        let name = &self.name;
        if self.data_location != 0 {
            return Err(format!("tensor `{name}` lies in another file, expected one file"));
        }
        if self.data_type != Self::FLOAT {
            return Err(format!("tensor `{name}` has type {}, expected 1 (float)", self.data_type));
        }
        let sizes = self.dims.iter().map(|size| usize::try_from(*size).ok().filter(|size| *size > 0));
        let shape: Option<Vec<usize>> = sizes.collect();
        let shape = shape
            .ok_or_else(|| format!("tensor `{name}` has shape {:?}, expected sizes above 0", self.dims))?;
        let (raw, rest) = self.raw_data.as_chunks::<4>();
        let mut values: Vec<f32> = raw.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
        values.extend(&self.float_data);
        if !rest.is_empty() {
            return Err(format!(
                "tensor `{name}` has {} bytes, expected a multiple of 4",
                self.raw_data.len()
            ));
        }
        check_num_values(name, &shape, values.len())?;
        check_finite(name, &values)?;
        Ok((shape, values))
    }

    /// Returns the values of a tensor of whole numbers.
    pub fn integers(&self) -> Option<Vec<i64>> {
        if self.data_type != Self::INT64 || self.data_location != 0 {
            return None;
        }
        let raw = self.raw_data.as_chunks::<8>().0.iter().map(|bytes| i64::from_le_bytes(*bytes));
        Some(raw.chain(self.int64_data.iter().copied()).collect())
    }
}
