//! The caller's arrays, into which a batch writes its results.

use super::encoders::Encoded;
use numpy::{
    Element, PyArrayDyn, PyArrayMethods, PyReadwriteArray2, PyReadwriteArray3, PyReadwriteArrayDyn,
    PyUntypedArrayMethods,
};
use pogema_core::Error;
use pogema_fast::{ApartBuffers, Batch, Engine, GlobalBuffers, Observations, Windows};
use pyo3::exceptions::{PyKeyError, PyRuntimeError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

type Array<'py, T> = PyReadwriteArrayDyn<'py, T>;

/// A caller's buffer for observations: an array, or a dictionary of arrays with POGEMA's keys.
pub enum Buffer<'py> {
    F32(Array<'py, f32>),
    U8(Array<'py, u8>),
    Bits(Array<'py, u64>),
    Apart(Box<Apart<'py>>),
    /// The windows of encoders, and scalars if there are any.
    Encoded(Array<'py, f32>, Option<Array<'py, f32>>),
}

/// The arrays of `POMAPF` observations, and of `MAPF` observations if there is a global state.
pub struct Apart<'py> {
    obstacles: Buffer<'py>,
    agents: Buffer<'py>,
    xy: Array<'py, i64>,
    target_xy: Array<'py, i64>,
    global: Option<Global<'py>>,
}

/// The arrays of a global state.
pub struct Global<'py> {
    obstacles: Array<'py, u8>,
    cells: Array<'py, i64>,
    goals: Array<'py, i64>,
}

impl<'py> Buffer<'py> {
    /// Takes the buffers for the windows and scalars of encoders.
    pub fn encoded(arrays: &Bound<'py, PyAny>) -> PyResult<Self> {
        let Ok(dict) = arrays.cast::<PyDict>() else { return Ok(Self::Encoded(cast(arrays)?, None)) };
        Ok(Self::Encoded(cast(&value(dict, "windows")?)?, Some(cast(&value(dict, "scalars")?)?)))
    }

    /// Takes the buffers for the observations of the engine.
    pub fn new(arrays: &Bound<'py, PyAny>) -> PyResult<Self> {
        if let Ok(dict) = arrays.cast::<PyDict>() {
            return Apart::new(dict).map(|apart| Self::Apart(Box::new(apart)));
        }
        if let Ok(array) = arrays.cast::<PyArrayDyn<f32>>() {
            return borrow(array).map(Self::F32);
        }
        if let Ok(array) = arrays.cast::<PyArrayDyn<u64>>() {
            return borrow(array).map(Self::Bits);
        }
        cast(arrays).map(Self::U8)
    }

    /// Returns the buffers for the engine, and those for encoders if there are any.
    ///
    /// `radius` is the width of the border in `MAPF` observations.
    pub fn parts_mut(&mut self, radius: usize) -> PyResult<(Observations<'_>, Option<Encoded<'_>>)> {
        if let Self::Encoded(windows, scalars) = self {
            let scalars = scalars.as_mut().map(|scalars| scalars.as_slice_mut()).transpose()?;
            let (windows, scalars) = (windows.as_slice_mut()?, scalars.unwrap_or_default());
            return Ok((Observations::None, Some(Encoded { windows, scalars })));
        }
        Ok((self.observations_mut(radius)?, None))
    }

    fn observations_mut(&mut self, radius: usize) -> PyResult<Observations<'_>> {
        Ok(match self {
            Self::Encoded(..) => Observations::None,
            Self::F32(array) => Observations::F32(array.as_slice_mut()?),
            Self::U8(array) => Observations::U8(array.as_slice_mut()?),
            Self::Bits(array) => Observations::Bits(array.as_slice_mut()?),
            Self::Apart(apart) => Observations::Apart(apart.buffers_mut(radius)?),
        })
    }
}

impl<'py> Apart<'py> {
    fn new(dict: &Bound<'py, PyDict>) -> PyResult<Self> {
        let has_global = dict.contains("global_obstacles")?;
        let keys = ["global_obstacles", "global_xy", "global_target_xy"];
        Ok(Self {
            obstacles: Buffer::new(&value(dict, "obstacles")?)?,
            agents: Buffer::new(&value(dict, "agents")?)?,
            xy: cast(&value(dict, "xy")?)?,
            target_xy: cast(&value(dict, "target_xy")?)?,
            global: has_global.then(|| Global::new(dict, keys)).transpose()?,
        })
    }

    fn buffers_mut(&mut self, radius: usize) -> PyResult<ApartBuffers<'_>> {
        let windows = match (&mut self.obstacles, &mut self.agents) {
            (Buffer::F32(obstacles), Buffer::F32(agents)) => {
                Windows::F32(obstacles.as_slice_mut()?, agents.as_slice_mut()?)
            }
            (Buffer::U8(obstacles), Buffer::U8(agents)) => {
                Windows::U8(obstacles.as_slice_mut()?, agents.as_slice_mut()?)
            }
            _ => {
                return Err(PyTypeError::new_err(
                    "windows have the wrong type, expected float32 or uint8 for both",
                ));
            }
        };
        let global = self.global.as_mut().map(|global| global.buffers_mut(radius)).transpose()?;
        let (xy, target_xy) = (self.xy.as_slice_mut()?, self.target_xy.as_slice_mut()?);
        Ok(ApartBuffers { windows, xy, target_xy, global })
    }
}

impl<'py> Global<'py> {
    /// Takes the arrays for obstacles, cells and goals with these keys.
    pub fn new(dict: &Bound<'py, PyDict>, keys: [&str; 3]) -> PyResult<Self> {
        let [obstacles, cells, goals] = keys;
        Ok(Self {
            obstacles: cast(&value(dict, obstacles)?)?,
            cells: cast(&value(dict, cells)?)?,
            goals: cast(&value(dict, goals)?)?,
        })
    }

    pub fn buffers_mut(&mut self, border: usize) -> PyResult<GlobalBuffers<'_>> {
        let &[_, rows, columns] = self.obstacles.shape() else {
            return Err(PyTypeError::new_err("maps have the wrong number of axes, expected 3"));
        };
        Ok(GlobalBuffers {
            size: (rows, columns),
            border,
            obstacles: self.obstacles.as_slice_mut()?,
            cells: self.cells.as_slice_mut()?,
            goals: self.goals.as_slice_mut()?,
        })
    }
}

fn value<'py>(dict: &Bound<'py, PyDict>, key: &str) -> PyResult<Bound<'py, PyAny>> {
    dict.get_item(key)?.ok_or_else(|| PyKeyError::new_err(key.to_owned()))
}

fn cast<'py, T: Element>(array: &Bound<'py, PyAny>) -> PyResult<Array<'py, T>> {
    let array = array.cast::<PyArrayDyn<T>>();
    borrow(array.map_err(|_| PyTypeError::new_err("the buffer for observations has the wrong type"))?)
}

fn borrow<'py, T: Element>(array: &Bound<'py, PyArrayDyn<T>>) -> PyResult<Array<'py, T>> {
    array.try_readwrite().map_err(|error| {
        PyRuntimeError::new_err(format!("the buffer for observations cannot be written: {error}"))
    })
}

pub fn masks_mut<'a>(masks: &'a mut Option<PyReadwriteArray3<'_, i8>>) -> PyResult<Option<&'a mut [i8]>> {
    Ok(masks.as_mut().map(|masks| masks.as_slice_mut()).transpose()?)
}

/// Writes which agents are active: now in all environments, or at the ends of the last episodes of some.
pub fn write_active(
    batch: &Batch,
    ended: Option<&[usize]>,
    active: PyReadwriteArray2<'_, bool>,
) -> Result<(), Error> {
    write_flags(batch, ended, active, |engine, agents| agents.copy_from_slice(engine.active()))
}

/// Writes which rows are agents, and not padding: in the current episodes of all environments, or in the last episodes
/// of some.
pub fn write_agents(
    batch: &Batch,
    ended: Option<&[usize]>,
    agents: PyReadwriteArray2<'_, bool>,
) -> Result<(), Error> {
    write_flags(batch, ended, agents, |_, agents| agents.fill(true))
}

/// Calls `write` to write a flag for each agent, and writes false into padding.
fn write_flags(
    batch: &Batch,
    ended: Option<&[usize]>,
    mut flags: PyReadwriteArray2<'_, bool>,
    write: impl Fn(&Engine, &mut [bool]),
) -> Result<(), Error> {
    let not_contiguous =
        |_| Error::Corrupt { what: "flags".into(), reason: "the array is not contiguous".into() };
    let flags = flags.as_slice_mut().map_err(not_contiguous)?;
    let num_agents = batch.config().num_agents;
    let expected = num_agents * ended.map_or(batch.num_lanes(), <[usize]>::len);
    Error::check_length("flags", expected, flags.len())?;
    for (index, part) in flags.chunks_exact_mut(num_agents).enumerate() {
        let engine = match ended {
            Some(envs) => batch.ended(envs[index])?.ok_or(Error::NotEnded { lane: envs[index] })?.0,
            None => batch.lane(index)?,
        };
        let (agents, padding) = part.split_at_mut(engine.active().len());
        write(engine, agents);
        padding.fill(false);
    }
    Ok(())
}
