//! Reads Python values as the fields of a config.

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyString};
use serde_json::{Map as Object, Number, Value};

/// The fields of a config, from a dictionary of Python values.
///
/// Errors: `TypeError` for a key that is not a string, or a value that is not a number, a string or a sequence;
/// `ValueError` for lists nested more than [`DEEPEST`] deep, for example a list that contains itself.
pub struct Fields(pub Value);

impl<'py> FromPyObject<'_, 'py> for Fields {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let mut fields = Object::new();
        for (key, field) in object.cast::<PyDict>()?.iter() {
            let name: String = key.extract()?;
            let plain = value(&name, &field, 0)?;
            fields.insert(name, plain);
        }
        Ok(Self(Value::Object(fields)))
    }
}

/// The nesting limit: lists in a config are at most three deep, and a list that contains itself is infinitely deep.
const DEEPEST: usize = 16;

/// Returns the value of the field `name`, or a part of it.
fn value(name: &str, object: &Bound<'_, PyAny>, depth: usize) -> PyResult<Value> {
    if depth > DEEPEST {
        return Err(PyValueError::new_err(format!("`{name}` holds lists nested more than {DEEPEST} deep")));
    }
    if object.is_none() {
        return Ok(Value::Null);
    }
    if let Ok(flag) = object.cast::<PyBool>() {
        return Ok(flag.is_true().into());
    }
    if object.is_instance_of::<PyInt>()
        && let Ok(whole) = object.extract::<i64>()
    {
        return Ok(whole.into());
    }
    if object.is_instance_of::<PyInt>() || object.is_instance_of::<PyFloat>() {
        let number = object.extract().ok().and_then(Number::from_f64);
        return Ok(number.map_or_else(|| shown(object), Value::Number));
    }
    if let Ok(text) = object.cast::<PyString>() {
        return Ok(text.to_str()?.into());
    }
    // NumPy numbers and arrays.
    if let Ok(plain) = object.call_method0("tolist") {
        return value(name, &plain, depth + 1);
    }
    let named = |error: PyErr| {
        // Iterators of callers may raise other errors.
        if !error.is_instance_of::<PyTypeError>(object.py()) {
            return error;
        }
        let kind = object.get_type().name().map_or_else(|_| "?".into(), |name| name.to_string());
        PyTypeError::new_err(format!(
            "`{name}` holds an object of type `{kind}`, expected numbers, strings or lists"
        ))
    };
    let items = object.try_iter().map_err(named)?.map(|item| {
        if depth == 0 {
            object.py().check_signals()?;
        }
        value(name, &item?, depth + 1)
    });
    Ok(Value::Array(items.collect::<PyResult<_>>()?))
}

/// Returns the text of a number that no field can hold, so that the error of the config shows the number.
fn shown(object: &Bound<'_, PyAny>) -> Value {
    object.to_string().into()
}
