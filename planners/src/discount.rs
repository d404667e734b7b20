//! What a delay weighs: the less, the farther ahead it lies, since by then goals may be others.

/// The loss that costs are, growing ever more slowly with them.
#[derive(Clone, Debug)]
pub(crate) struct Discount {
    /// For costs from 0 on; none if every step is lost alike.
    losses: Vec<u64>,
}

impl Discount {
    /// Costs that are told apart; beyond, no step is lost any more.
    const MOST_COSTS: usize = 1024;
    /// What is lost by never arriving.
    const UNIT: u64 = 1 << 40;

    /// Each step weighs so many times the one before; 1 and more, and what is no number, mean alike.
    pub fn new(factor: f64) -> Self {
        if factor.is_nan() || factor >= 1.0 {
            return Self { losses: Vec::new() };
        }
        // In whole numbers, which are the same on every machine.
        let factor = u128::from((factor.max(0.0) * (1_u64 << 32) as f64) as u64);
        let left =
            std::iter::successors(Some(Self::UNIT), |&left| Some(((u128::from(left) * factor) >> 32) as u64));
        Self { losses: left.take(Self::MOST_COSTS).map(|left| Self::UNIT - left).collect() }
    }

    /// What is lost by arriving after so many steps.
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
        for alike in [1.0, 2.0, f64::NAN] {
            assert_eq!(Discount::new(alike).loss(7), 7);
        }
        assert_eq!(Discount::new(-1.0).loss(1), Discount::UNIT);
    }
}
