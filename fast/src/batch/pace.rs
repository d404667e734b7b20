//! The choice between all threads of a team and the calling thread alone, by measured times.

use std::time::Duration;

/// Time after which the other way of working is tried again.
const LONG: Duration = Duration::from_secs(1);
/// Time for which it is tried: several time slices of the system's scheduler.
const SHORT: Duration = Duration::from_millis(20);

/// Chooses the faster way of working: with helper threads, or alone.
///
/// Helpers do not pay off if the work is small, or if other processes occupy their cores: the caller then waits for
/// threads that do not run. Both ways are measured, and the slower one is tried again from time to time. The results of
/// the work are the same.
#[derive(Debug, Default)]
pub struct Pace {
    is_alone: bool,
    /// Whether both ways have been measured in turn, so that the current one was the faster.
    is_chosen: bool,
    /// Time of the current way since it began, and the number of its calls.
    spent: Duration,
    num_calls: u32,
    /// Time per call of the other way when it was last measured.
    other: Option<Duration>,
}

impl Pace {
    /// Returns whether the next call should be played on the calling thread alone.
    pub fn is_alone(&self) -> bool {
        self.is_alone
    }

    /// Records the duration of a call, and switches to the other way when it is its turn.
    pub fn record(&mut self, duration: Duration) {
        self.spent = self.spent.saturating_add(duration);
        self.num_calls = self.num_calls.saturating_add(1);
        if self.spent < if self.is_chosen { LONG } else { SHORT } {
            return;
        }
        let own = self.spent / self.num_calls;
        (self.spent, self.num_calls) = (Duration::ZERO, 0);
        if self.is_chosen {
            (self.is_chosen, self.is_alone, self.other) = (false, !self.is_alone, Some(own));
            return;
        }
        // Without a time of the other way, it has its turn first.
        self.is_chosen = self.other.is_some();
        if self.other.is_none_or(|other| other < own) {
            (self.is_alone, self.other) = (!self.is_alone, Some(own));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns for each call whether it was alone, if calls take the given numbers of microseconds.
    fn choices(num_calls: usize, with_helpers: u64, alone: impl Fn(usize) -> u64) -> Vec<bool> {
        let mut pace = Pace::default();
        let call = |index| {
            let is_alone = pace.is_alone();
            pace.record(Duration::from_micros(if is_alone { alone(index) } else { with_helpers }));
            is_alone
        };
        (0..num_calls).map(call).collect()
    }

    fn share(choices: &[bool]) -> f64 {
        choices.iter().filter(|&&is_alone| is_alone).count() as f64 / choices.len() as f64
    }

    #[test]
    fn the_faster_way_is_chosen_and_the_other_is_tried_now_and_then() {
        let fast = choices(100_000, 100, |_| 200);
        assert!(!fast[0] && share(&fast) > 0.001 && share(&fast) < 0.02);
        let slow = choices(100_000, 200, |_| 100);
        assert!(!slow[0] && share(&slow) > 0.98 && share(&slow) < 0.999);
    }

    #[test]
    fn the_choice_follows_a_change() {
        let choices = choices(200_000, 200, |index| if index < 100_000 { 100 } else { 300 });
        assert!(share(&choices[..100_000]) > 0.98 && share(&choices[110_000..]) < 0.02);
    }

    #[test]
    fn one_call_may_take_longer_than_every_turn() {
        let seconds = choices(30, 5_000_000, |_| 3_000_000);
        assert_eq!(seconds[..6], [false, true, true, false, true, false]);
    }
}
