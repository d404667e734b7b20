//! Tensors by name, each of which a layer takes once.

use std::collections::BTreeMap;

use pogema_core::counted;

/// A tensor of finite floats.
#[derive(Clone, Debug, PartialEq)]
pub struct Tensor {
    pub shape: Vec<usize>,
    pub values: Vec<f32>,
}

/// Checks that no value of a tensor is infinite or NaN.
pub(crate) fn check_finite(name: &str, values: &[f32]) -> Result<(), String> {
    match values.iter().position(|value| !value.is_finite()) {
        Some(index) => {
            let value = values[index];
            Err(format!("tensor `{name}`: value {index} is `{value}`, expected a finite number"))
        }
        None => Ok(()),
    }
}

/// Checks that the number of values of a tensor matches its shape.
pub(crate) fn check_num_values(name: &str, shape: &[usize], num_values: usize) -> Result<(), String> {
    let expected = shape.iter().try_fold(1usize, |product, size| product.checked_mul(*size));
    if expected == Some(num_values) {
        return Ok(());
    }
    let expected = expected.map_or_else(|| "more".to_owned(), |expected| expected.to_string());
    let found = counted(num_values, "value");
    Err(format!("tensor `{name}` has {found}, expected {expected} for the shape {shape:?}"))
}

/// All tensors of a file that no layer has taken yet. Errors are messages that name the tensor.
#[derive(Clone, Debug, Default)]
pub struct Tensors(BTreeMap<String, Tensor>);

impl Tensors {
    /// Adds a tensor whose bytes are floats in little-endian order.
    pub fn insert(&mut self, name: &str, shape: &[usize], bytes: &[u8]) -> Result<(), String> {
        let (floats, rest) = bytes.as_chunks::<4>();
        if !rest.is_empty() {
            return Err(format!(
                "tensor `{name}` has {}, expected a multiple of 4",
                counted(bytes.len(), "byte")
            ));
        }
        let values = floats.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
        self.insert_values(name, shape.into(), values)
    }

    /// Adds a tensor.
    pub fn insert_values(&mut self, name: &str, shape: Vec<usize>, values: Vec<f32>) -> Result<(), String> {
        check_num_values(name, &shape, values.len())?;
        check_finite(name, &values)?;
        match self.0.insert(name.into(), Tensor { shape, values }) {
            None => Ok(()),
            Some(_) => Err(format!("tensor `{name}` occurs twice")),
        }
    }

    /// Takes a tensor. `None` stands for any size above 0.
    pub fn take(&mut self, name: &str, shape: &[Option<usize>]) -> Result<Tensor, String> {
        let Some(tensor) = self.0.remove(name) else {
            return Err(format!("tensor `{name}` is missing or used by two layers"));
        };
        let fits = |(got, want): (&usize, &Option<usize>)| want.map_or(*got > 0, |want| *got == want);
        if tensor.shape.len() == shape.len() && tensor.shape.iter().zip(shape).all(fits) {
            return Ok(tensor);
        }
        let sizes: Vec<String> =
            shape.iter().map(|size| size.map_or("any size".into(), |size| size.to_string())).collect();
        Err(format!("tensor `{name}` has shape {:?}, expected [{}]", tensor.shape, sizes.join(", ")))
    }

    /// Checks that every tensor was taken.
    pub fn check_all_taken(&self) -> Result<(), String> {
        self.0.keys().next().map_or(Ok(()), |name| Err(format!("tensor `{name}` belongs to no layer")))
    }

    /// Returns the tensors by name.
    pub fn iter(&self) -> impl Iterator<Item = (&String, &Tensor)> {
        self.0.iter()
    }
}
