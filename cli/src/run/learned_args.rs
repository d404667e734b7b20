//! Flags of learned policies.

use std::path::{Path, PathBuf};

use clap::Args;
use pogema_core::{Error, Words};
use pogema_policies::{Learned, LearnedName, Sampling};

use crate::output::with_flag;
use crate::words::word;

/// The network of a learned policy.
#[derive(Args, Clone, Debug)]
pub struct LearnedArgs {
    /// Weights of the network of a learned policy, instead of those that the program contains
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    /// Rule that chooses actions from the logits of the network [default: that of its JSON file]
    #[arg(long, value_parser = word::<Sampling>())]
    sampling: Option<Sampling>,
    /// Forbid actions of the network that lead into an obstacle or off the map
    #[arg(long)]
    mask_actions: bool,
    /// Expansions of each search of `--policy mats-lp` [default: 250]
    #[arg(long, value_name = "N")]
    expansions: Option<u32>,
    /// Whether `--policy mats-lp` follows the published program, not the paper, where the two differ [default: true]
    #[arg(long, value_name = "BOOL")]
    faithful: Option<bool>,
}

impl LearnedArgs {
    /// Returns the file with the weights.
    pub fn weights(&self) -> Option<&Path> {
        self.weights.as_deref()
    }

    /// Reads the network, if the policy has one.
    pub fn read(&self, policy: &str) -> Result<Option<Learned>, Error> {
        let Some(name) = LearnedName::of_word(policy) else {
            let flags = [
                ("--weights", self.weights.is_some()),
                ("--sampling", self.sampling.is_some()),
                ("--mask-actions", self.mask_actions),
                ("--expansions", self.expansions.is_some()),
                ("--faithful", self.faithful.is_some()),
            ];
            return match flags.into_iter().find(|(_, is_given)| *is_given) {
                Some((flag, _)) => {
                    let learned = LearnedName::NAMES.join(", ");
                    Err(Error::request(format!(
                        "`{flag}` needs a learned policy: `--policy` with one of {learned}"
                    )))
                }
                None => Ok(None),
            };
        };
        let mut learned = match &self.weights {
            Some(file) => name.read(file)?,
            None if name.shipped_weights().is_some() => name.with_shipped_weights()?,
            None => return Err(Error::request(format!("`--policy {policy}` needs `--weights FILE`"))),
        };
        if let Some(rule) = self.sampling {
            learned = learned.with_sampling(rule)?;
        }
        if self.mask_actions {
            learned = learned.with_masks(true)?;
        }
        if let Some(expansions) = self.expansions {
            learned = learned.with_expansions(expansions).map_err(with_flag)?;
        }
        if let Some(faithful) = self.faithful {
            learned = learned.with_faithful(faithful).map_err(with_flag)?;
        }
        Ok(Some(learned))
    }
}
