//! The buffers of a caller for observations, global states and action masks.

mod apart;
mod global;

use pogema_core::{Action, Config, Error};

use crate::Engine;
use crate::observe::words_per_agent;

pub use apart::{ApartBuffers, Windows};
pub use global::GlobalBuffers;

/// The buffer for the observations of some lanes, if they are requested.
#[derive(Debug)]
pub enum Observations<'a> {
    /// No observations are requested.
    None,
    /// Shape: `[lanes, agents, 3, side, side]`
    F32(&'a mut [f32]),
    /// Shape: `[lanes, agents, 3, side, side]`
    U8(&'a mut [u8]),
    /// Shape: `[lanes, agents, words]` with [`words_per_agent`] words, in the format of
    /// [`crate::Engine::observe_bits`].
    Bits(&'a mut [u64]),
    /// The `POMAPF` or `MAPF` observations.
    Apart(ApartBuffers<'a>),
    /// The global states.
    Global(GlobalBuffers<'a>),
}

impl Observations<'_> {
    /// Returns the number of entries per lane, if the observations are one array.
    fn per_lane(&self, config: &Config) -> usize {
        match self {
            Self::None | Self::Apart(_) | Self::Global(_) => 0,
            Self::F32(_) | Self::U8(_) => config.num_observed(),
            Self::Bits(_) => config.num_agents * words_per_agent(config.radius),
        }
    }

    /// Checks the lengths of all buffers.
    pub(crate) fn check(&self, num_lanes: usize, config: &Config) -> Result<(), Error> {
        let len = match self {
            Self::None => 0,
            Self::F32(out) => out.len(),
            Self::U8(out) => out.len(),
            Self::Bits(out) => out.len(),
            Self::Apart(out) => return out.check(num_lanes, config),
            Self::Global(out) => return out.check(num_lanes, config),
        };
        Error::check_length("observations", num_lanes * self.per_lane(config), len)
    }

    /// Removes the buffers of the first lanes, and returns them.
    #[inline]
    pub(crate) fn take_first(&mut self, num_lanes: usize, config: &Config) -> Self {
        let num_entries = num_lanes * self.per_lane(config);
        match self {
            Self::None => Self::None,
            Self::F32(out) => Self::F32(take_first(out, num_entries)),
            Self::U8(out) => Self::U8(take_first(out, num_entries)),
            Self::Bits(out) => Self::Bits(take_first(out, num_entries)),
            Self::Apart(out) => Self::Apart(out.take_first(num_lanes, config)),
            Self::Global(out) => Self::Global(out.take_first(num_lanes, config)),
        }
    }

    /// Returns the number of bytes that streaming stores can write.
    pub(crate) fn num_streamable(&self) -> usize {
        match self {
            Self::None | Self::Bits(_) | Self::Global(_) => 0,
            Self::F32(out) => size_of_val(*out),
            Self::U8(out) => size_of_val(*out),
            Self::Apart(out) => out.windows.num_bytes(),
        }
    }

    /// Writes the buffers of one lane; the rows beyond its agents become 0.
    pub(crate) fn write(self, engine: &Engine, streaming: bool) -> Result<(), Error> {
        let num_entries = self.per_lane(&engine.config);
        match self {
            Self::None => Ok(()),
            Self::F32(out) => {
                engine.observe_all(pad(out, num_entries), streaming);
                Ok(())
            }
            Self::U8(out) => {
                engine.observe_all(pad(out, num_entries), streaming);
                Ok(())
            }
            Self::Bits(out) => engine.observe_bits(0..engine.config.num_agents, pad(out, num_entries)),
            Self::Apart(out) => out.write(engine, streaming),
            Self::Global(out) => out.write(engine),
        }
    }
}

impl Engine {
    /// Writes the observations of all agents, in the form of the buffers for one lane.
    ///
    /// # Errors
    /// Before the first reset, for a buffer of the wrong length, or for a map that is larger than its buffer.
    #[inline]
    pub fn observe_into(&self, observations: Observations<'_>) -> Result<(), Error> {
        let all = 0..self.config.num_agents;
        // A single engine needs no padding. For few agents, the general way takes noticeable time.
        match observations {
            Observations::None => self.check_started(),
            Observations::F32(out) => self.observe_agents(all, out),
            Observations::U8(out) => self.observe_agents(all, out),
            Observations::Bits(out) => self.observe_bits(all, out),
            Observations::Apart(_) | Observations::Global(_) => {
                self.check_started()?;
                observations.check(1, &self.config)?;
                let streaming = self.is_streamed(observations.num_streamable());
                observations.write(self, streaming)
            }
        }
    }
}

/// The buffers that a step or an observation of a batch fills. [`Observations`] convert into buffers without masks.
#[derive(Debug)]
pub struct ObservationBuffers<'a> {
    /// The buffer for observations.
    pub observations: Observations<'a>,
    /// The buffer for action masks, in the format of [`crate::Engine::mask_actions`], if they are requested.
    ///
    /// Shape: `[lanes, agents, 5]`
    pub masks: Option<&'a mut [i8]>,
}

impl<'a> From<Observations<'a>> for ObservationBuffers<'a> {
    fn from(observations: Observations<'a>) -> Self {
        Self { observations, masks: None }
    }
}

impl ObservationBuffers<'_> {
    pub(crate) fn check(&self, num_lanes: usize, config: &Config) -> Result<(), Error> {
        self.observations.check(num_lanes, config)?;
        let expected = num_lanes * config.num_agents * Action::ALL.len();
        self.masks.as_ref().map_or(Ok(()), |masks| Error::check_length("action masks", expected, masks.len()))
    }

    /// Checks that the maps of all engines fit the buffers.
    pub(crate) fn check_maps<'e>(&self, engines: impl IntoIterator<Item = &'e Engine>) -> Result<(), Error> {
        let buffers = match &self.observations {
            Observations::Global(buffers) => Some(buffers),
            Observations::Apart(buffers) => buffers.global.as_ref(),
            _ => None,
        };
        let Some(buffers) = buffers else { return Ok(()) };
        engines.into_iter().try_for_each(|engine| buffers.padded(engine).map(|_| ()))
    }

    /// Removes the buffers of the first lanes, and returns them.
    #[inline]
    pub(crate) fn take_first(&mut self, num_lanes: usize, config: &Config) -> Self {
        let num_masks = num_lanes * config.num_agents * Action::ALL.len();
        let masks = self.masks.as_mut().map(|masks| take_first(masks, num_masks));
        Self { observations: self.observations.take_first(num_lanes, config), masks }
    }

    pub(crate) fn write(self, engine: &Engine, streaming: bool) -> Result<(), Error> {
        self.observations.write(engine, streaming)?;
        let Some(masks) = self.masks else { return Ok(()) };
        let (masks, padding) = masks.split_at_mut(engine.config.num_agents * Action::ALL.len());
        for mask in padding.chunks_exact_mut(Action::ALL.len()) {
            mask.fill(0);
            mask[0] = 1;
        }
        engine.mask_actions(masks)
    }
}

/// Removes the first entries of a buffer, and returns them.
#[allow(clippy::mut_mut, reason = "the caller keeps the rest of its buffer")]
fn take_first<'a, T>(buffer: &mut &'a mut [T], num_entries: usize) -> &'a mut [T] {
    buffer.split_off_mut(..num_entries).unwrap_or_default()
}

/// Fills a buffer with 0 after the entries of a lane's agents, and returns these entries.
fn pad<T: Default + Clone>(buffer: &mut [T], num_entries: usize) -> &mut [T] {
    let (entries, padding) = buffer.split_at_mut(num_entries);
    padding.fill(T::default());
    entries
}
