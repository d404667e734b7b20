//! Discounted costs: a delay in the distant future weighs less, because goals may have changed by then.

/// A concave function from costs to losses.
#[derive(Clone, Debug)]
pub(crate) struct Discount {
    /// The loss of each cost from 0 on; empty without a discount.
    losses: Vec<u64>,
}

impl Discount {
    /// Number of costs that have their own loss; higher costs have the loss of the highest of these.
    const MAX_COSTS: usize = 1024;
    /// The loss of never arriving.
    const UNIT: u64 = 1 << 40;

    /// Creates a discount by a factor per step. A factor of at least 1, or NaN, means no discount.
    pub fn new(factor: f64) -> Self {
        if factor.is_nan() || factor >= 1.0 {
            return Self { losses: Vec::new() };
        }
        // Integer arithmetic gives the same losses on every machine.
        let factor = u128::from((factor.max(0.0) * (1_u64 << 32) as f64) as u64);
        let left =
            std::iter::successors(Some(Self::UNIT), |&left| Some(((u128::from(left) * factor) >> 32) as u64));
        Self { losses: left.take(Self::MAX_COSTS).map(|left| Self::UNIT - left).collect() }
    }

    /// Returns the loss of a cost.
    pub fn loss(&self, cost: u32) -> u64 {
        match self.losses.last() {
            Some(&most) => self.losses.get(cost as usize).copied().unwrap_or(most),
            None => u64::from(cost),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Discount;

    #[test]
    fn steps_far_ahead_weigh_less() {
        let discount = Discount::new(0.5);
        let lost = |cost: u32| discount.loss(cost + 1) - discount.loss(cost);
        assert_eq!(lost(0), Discount::UNIT / 2);
        assert!((0..20).all(|cost| lost(cost) == 2 * lost(cost + 1)));
        assert_eq!(discount.loss(u32::MAX), discount.loss(5000));
    }

    #[test]
    fn factors_of_at_least_1_mean_no_discount_and_negative_factors_are_0() {
        for alike in [1.0, 2.0, f64::NAN] {
            assert_eq!(Discount::new(alike).loss(7), 7);
        }
        assert_eq!(Discount::new(-1.0).loss(1), Discount::UNIT);
    }
}
