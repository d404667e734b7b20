//! Parameters of MATS-LP.

use pogema_core::Error;

/// The parameters of [`crate::MatsLp`]; the defaults are the published ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MatsLpParams {
    /// Number of leaves that each search adds to its tree after the root, 1 to 100,000.
    pub expansions: u32,
    /// Weight of a value one step later, above 0 and at most 1.
    pub discount: f64,
    /// Weight of the prior against the value in the choice of a child, 0 to 1,000,000.
    pub exploration: f64,
    /// Share of a uniform distribution in the prior of the root, 0 to 1. It is not random.
    pub root_noise: f64,
    /// Number of agents of the group whose actions the tree branches on, 1 to 6; the network's best action is taken for
    /// the others.
    pub agents_to_plan: usize,
    /// An agent joins a group if it is fewer steps than this away, 1 to 128. Units: steps on the map without agents.
    pub merging_range: u32,
    /// An agent joins a group only if its row and its column differ by at most this, 1 to 128. Units: cells.
    pub radius: u32,
    /// Reward of a group if all its agents get nearer to their goals than ever before, 0 to 1,000,000.
    pub progress_reward: f64,
    /// Whether the search equals the published program where the program deviates from the paper.
    ///
    /// The program reads the wrong output of its network as the critic's value, so the value of a leaf is 0. It also
    /// adds the reward of the leaf at each level of the backup, and discounts the earlier rewards once more. With
    /// rewards `r1` to `rD` on the path to a leaf at depth `D`, the node at depth `k` gets
    /// `rD + sum over k < j < D of discount^(j - k) * rj`.
    ///
    /// If false, the value of a leaf is the mean of the critic's values over the group, and the node at depth `k` gets
    /// `sum over k < j <= D of discount^(j - k - 1) * rj + discount^(D - k) * value`.
    pub faithful: bool,
}

impl Default for MatsLpParams {
    fn default() -> Self {
        Self {
            expansions: 250,
            discount: 0.96,
            exploration: 4.44,
            root_noise: 0.6,
            agents_to_plan: 3,
            merging_range: 5,
            radius: 5,
            progress_reward: 0.1,
            faithful: true,
        }
    }
}

impl MatsLpParams {
    /// Checks that every parameter is in its range.
    ///
    /// # Errors
    /// [`Error::Argument`] naming the first parameter that is out of range.
    pub fn check(&self) -> Result<(), Error> {
        let whole = [
            ("expansions", u64::from(self.expansions), 100_000),
            ("agents_to_plan", self.agents_to_plan as u64, 6),
            ("merging_range", u64::from(self.merging_range), 128),
            ("radius", u64::from(self.radius), 128),
        ];
        for (name, value, most) in whole {
            if !(1..=most).contains(&value) {
                return Err(Error::argument(name, value, format!("1 to {most}")));
            }
        }
        let real = [
            ("discount", self.discount, self.discount > 0.0 && self.discount <= 1.0, "above 0, at most 1"),
            ("exploration", self.exploration, (0.0..=1e6).contains(&self.exploration), "0 to 1000000"),
            ("root_noise", self.root_noise, (0.0..=1.0).contains(&self.root_noise), "0 to 1"),
            (
                "progress_reward",
                self.progress_reward,
                (0.0..=1e6).contains(&self.progress_reward),
                "0 to 1000000",
            ),
        ];
        for (name, value, is_valid, expected) in real {
            if !is_valid {
                return Err(Error::argument(name, value, expected));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid_and_wrong_values_are_named() {
        let good = MatsLpParams::default();
        assert_eq!(good.check(), Ok(()));
        let wrong = [
            MatsLpParams { expansions: 0, ..good },
            MatsLpParams { agents_to_plan: 7, ..good },
            MatsLpParams { merging_range: 0, ..good },
            MatsLpParams { radius: 129, ..good },
            MatsLpParams { discount: f64::NAN, ..good },
            MatsLpParams { exploration: -1.0, ..good },
            MatsLpParams { root_noise: 1.5, ..good },
            MatsLpParams { progress_reward: f64::INFINITY, ..good },
        ];
        let messages = wrong.map(|params| params.check().map_err(|error| error.to_string()));
        assert_eq!(messages[0], Err("`expansions` is `0`, expected 1 to 100000".into()));
        assert_eq!(messages[4], Err("`discount` is `NaN`, expected above 0, at most 1".into()));
        assert!(messages.iter().all(Result::is_err));
    }
}
