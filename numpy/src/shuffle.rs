//! Random permutations.

use crate::Generator;

/// Number of indices that are drawn before their items are swapped.
const BATCH: usize = 128;

impl Generator {
    /// Shuffles a list, or an array along its first axis: NumPy makes the same draws for both.
    ///
    /// Swaps each item, from the last to the second, with itself or an earlier item. The index of that item is drawn by
    /// masked rejection sampling, in 32 bits if the largest possible index fits. [`Generator::integers`] would draw a
    /// different index.
    ///
    /// Source: NumPy 1.26, `Generator.shuffle`.
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        let mut num_left = items.len();
        while num_left as u64 > 1 << 32 {
            num_left -= 1;
            let other = self.draw_wide(num_left as u64);
            items.swap(num_left, other as usize);
        }
        // In a long list each swap waits for memory. Without draws between them, several swaps wait at the same time.
        let mut others = [0; BATCH];
        while num_left > 1 {
            let batch = &mut others[..BATCH.min(num_left - 1)];
            self.draw_batch(num_left as u64 - 1, batch);
            for &mut other in batch {
                num_left -= 1;
                items.swap(num_left, other as usize);
            }
        }
    }

    /// Draws one index of at most `last`, which is above 2³²-1.
    fn draw_wide(&mut self, last: u64) -> u64 {
        let mask = u64::MAX >> last.leading_zeros();
        loop {
            let draw = self.next_u64() & mask;
            if draw <= last {
                return draw;
            }
        }
    }

    /// Draws one index of at most `last`, which is below 2³², then one of at most `last - 1`, and so on until the batch
    /// is full.
    fn draw_batch(&mut self, last: u64, batch: &mut [u32]) {
        let mut filled = 0;
        while filled < batch.len() {
            let last = (last - filled as u64) as u32;
            let draw = self.next_u32() & u32::MAX >> last.leading_zeros();
            batch[filled] = draw;
            // A sum, not a branch, because a processor cannot predict which draws fit.
            filled += usize::from(draw <= last);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected values: NumPy 1.26.4 with seed 6, on a sequence that claims to have 2³³ + 5 items and records
    /// which of them are swapped.
    #[test]
    fn indices_beyond_32_bits_take_64_bit_draws() {
        let mut generator = Generator::seeded(6);
        let draws: [u64; 3] = std::array::from_fn(|turn| generator.draw_wide((1 << 33) + 4 - turn as u64));
        assert_eq!(draws, [6_206_423_806, 4_063_638_511, 2_824_942_437]);
    }

    /// Expected values as above, for 2³² + 3 items: three wide indices, then narrow ones.
    #[test]
    fn the_last_index_of_32_bits_takes_a_32_bit_draw() {
        let mut generator = Generator::seeded(6);
        let wide: [u64; 3] = std::array::from_fn(|turn| generator.draw_wide((1 << 32) + 2 - turn as u64));
        assert_eq!(wide, [4_063_638_511, 2_824_942_437, 1_833_852_138]);
        let mut narrow = [0; 2];
        generator.draw_batch((1 << 32) - 1, &mut narrow);
        assert_eq!(narrow, [3_245_702_857, 1_417_182_249]);
    }

    #[test]
    fn a_single_item_makes_no_draw() {
        let mut generator = Generator::seeded(6);
        generator.shuffle::<u8>(&mut []);
        generator.shuffle(&mut [1]);
        assert_eq!(generator, Generator::seeded(6));
    }
}
