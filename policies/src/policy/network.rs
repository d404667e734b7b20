//! Networks as policies: the settings with which a network acts.

use pogema_core::Error;

use crate::encode::EncoderSettings;
use crate::follower::FollowerVersion;
use crate::network::{Network, Sampling, SamplingConfig};
use crate::policy::network_player::NetworkSettings;
use crate::policy::sampler::NUM_ACTIONS;

/// A network with everything that it needs to act.
#[derive(Clone, Debug)]
pub struct NetworkPolicy(NetworkSettings);

impl NetworkPolicy {
    /// Creates a policy of a network with its own encoder and sampling.
    ///
    /// # Errors
    /// [`Error::Request`] if the network has no encoder, if the encoder has another shape, or if the network does not
    /// have one logit for each action; [`Error::Config`] for invalid settings of the encoder.
    pub fn new(network: Network) -> Result<Self, Error> {
        let encoder = encoder_of(&network)?;
        Self::with_encoder(network, encoder)
    }

    /// Creates a policy of a network with an encoder in place of its own.
    ///
    /// # Errors
    /// Those of [`NetworkPolicy::new`].
    pub fn with_encoder(network: Network, encoder: EncoderSettings) -> Result<Self, Error> {
        check_encoder(&network, &encoder)?;
        if network.num_actions() != NUM_ACTIONS {
            let found = network.num_actions();
            return Err(Error::request(format!("the network has {found} logits, expected {NUM_ACTIONS}")));
        }
        let SamplingConfig { rule: sampling, mask_actions: masks_actions } = network.config().sampling;
        Ok(Self(NetworkSettings { network, encoder, sampling, masks_actions }))
    }

    /// Creates the policy Follower. A network without an encoder gets Follower's, so its window must have the two
    /// channels of Follower.
    ///
    /// # Errors
    /// Those of [`NetworkPolicy::new`].
    pub fn follower(network: Network) -> Result<Self, Error> {
        let [_, side, _] = network.input_shape();
        let usual = || EncoderSettings::follower(side / 2, FollowerVersion::default());
        let encoder = network.config().encoder.clone().unwrap_or_else(usual);
        Self::with_encoder(network, encoder)
    }

    /// Returns the network.
    pub fn network(&self) -> &Network {
        &self.0.network
    }

    /// Returns the settings of the encoder: what the network sees.
    pub fn encoder(&self) -> &EncoderSettings {
        &self.0.encoder
    }

    /// Returns the rule that chooses actions.
    pub fn sampling(&self) -> Sampling {
        self.0.sampling
    }

    /// Replaces the rule that chooses actions.
    #[must_use]
    pub fn with_sampling(mut self, sampling: Sampling) -> Self {
        self.0.sampling = sampling;
        self
    }

    /// Sets whether actions that lead into an obstacle or off the map are forbidden.
    #[must_use]
    pub fn with_masks(mut self, masks_actions: bool) -> Self {
        self.0.masks_actions = masks_actions;
        self
    }

    /// Returns everything that the network needs to act.
    pub(crate) fn settings(&self) -> &NetworkSettings {
        &self.0
    }
}

/// Returns the encoder that a network names.
///
/// # Errors
/// Those of [`NetworkPolicy::new`].
pub(crate) fn encoder_of(network: &Network) -> Result<EncoderSettings, Error> {
    let Some(encoder) = network.config().encoder.clone() else {
        return Err(Error::request("the network names no encoder, expected `encoder` in its JSON file"));
    };
    check_encoder(network, &encoder)?;
    Ok(encoder)
}

/// Checks that a network can read what an encoder writes.
fn check_encoder(network: &Network, encoder: &EncoderSettings) -> Result<(), Error> {
    encoder.check()?;
    let (input, output) = (network.input_shape(), encoder.shape());
    if input != output || network.num_scalars() != encoder.scalars_len() {
        return Err(Error::request(format!(
            "the encoder writes windows of shape {output:?} and {} scalars, the network expects {input:?} and {}",
            encoder.scalars_len(),
            network.num_scalars()
        )));
    }
    Ok(())
}
