//! The choice between all threads of a team and the calling thread alone, by measured times.

use std::time::Duration;

/// Time for which a way of working is tried: several time slices of the system's scheduler.
const TRIAL: Duration = Duration::from_millis(20);
/// Time after a choice until the other way is tried again. It is short, so that a choice made in a slow moment is soon
/// corrected, and doubles with each trial that confirms the choice, up to [`LAST_TERM`].
const FIRST_TERM: Duration = Duration::from_millis(40);
const LAST_TERM: Duration = Duration::from_secs(1);
/// Least number of calls between two trials, so that trials of long calls cost little, too.
const TERM_CALLS: u32 = 16;

/// Chooses the faster way of working: with helper threads, or alone.
///
/// Helpers do not pay off if the work is small, or if other processes occupy their cores: the caller then waits for
/// threads that do not run. Both ways are measured, and the slower one is tried again from time to time. The results of
/// the work are the same.
#[derive(Debug)]
pub struct Pace {
    is_alone: bool,
    /// Whether the first trial is over. It is not counted, because its calls touch new memory and start threads.
    is_warm: bool,
    /// Whether both ways have been measured in turn, and the current one was the faster.
    is_chosen: bool,
    /// Time from the choice to the next trial.
    term: Duration,
    /// Time spent in the current way since it began, and the number of its calls.
    spent: Duration,
    num_calls: u32,
    /// Time per call of the other way when it was last measured.
    other: Option<Duration>,
}

impl Default for Pace {
    fn default() -> Self {
        Self {
            is_alone: false,
            is_warm: false,
            is_chosen: false,
            // If the first choice switches to the other way, it doubles this term.
            term: FIRST_TERM / 2,
            spent: Duration::ZERO,
            num_calls: 0,
            other: None,
        }
    }
}

impl Pace {
    /// Returns whether the next call should run on the calling thread alone.
    pub fn is_alone(&self) -> bool {
        self.is_alone
    }

    /// Records the duration of a call, and switches to the other way when it is its turn.
    pub fn record(&mut self, duration: Duration) {
        self.spent = self.spent.saturating_add(duration);
        self.num_calls = self.num_calls.saturating_add(1);
        let (time, num_calls) = if self.is_chosen { (self.term, TERM_CALLS) } else { (TRIAL, 1) };
        if self.spent < time || self.num_calls < num_calls {
            return;
        }
        let own = self.spent / self.num_calls;
        (self.spent, self.num_calls) = (Duration::ZERO, 0);
        if !self.is_warm {
            (self.is_warm, self.is_alone) = (true, true);
        } else if self.is_chosen {
            (self.is_chosen, self.is_alone, self.other) = (false, !self.is_alone, Some(own));
        } else {
            self.choose(own);
        }
    }

    /// Chooses a way after a trial with this time per call. If the other way has not been
    /// measured, its turn comes first.
    fn choose(&mut self, own: Duration) {
        self.is_chosen = self.other.is_some();
        if self.other.is_none_or(|other| other < own) {
            if self.is_chosen {
                self.term = (2 * self.term).min(LAST_TERM);
            }
            (self.is_alone, self.other) = (!self.is_alone, Some(own));
        } else {
            self.term = FIRST_TERM;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns for each call whether it ran on the calling thread alone, if calls take the given numbers of
    /// microseconds.
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
    fn the_faster_way_is_chosen_and_the_other_is_tried_at_times() {
        let fast = choices(100_000, 100, |_| 200);
        assert!(!fast[0] && share(&fast) > 0.001 && share(&fast) < 0.02);
        let slow = choices(100_000, 200, |_| 100);
        assert!(!slow[0] && share(&slow) > 0.98 && share(&slow) < 0.999);
    }

    #[test]
    fn the_choice_follows_a_change() {
        let choices = choices(200_000, 200, |index| if index < 100_000 { 100 } else { 300 });
        assert!(share(&choices[..100_000]) > 0.97 && share(&choices[110_000..]) < 0.03);
    }

    #[test]
    fn a_choice_made_in_a_slow_moment_is_soon_corrected() {
        // The calls with helpers are slow in the first 30 ms after the warm-up and the trial of the other way.
        let mut pace = Pace::default();
        let (mut time, mut num_alone) = (0, 0);
        while time < 500_000 {
            let micros = match pace.is_alone() {
                true => 200,
                false if time < 70_000 => 400,
                false => 100,
            };
            num_alone += u32::from(pace.is_alone());
            pace.record(Duration::from_micros(micros));
            time += micros;
        }
        assert!(num_alone * 200 < 150_000, "{num_alone} calls");
    }

    #[test]
    fn trials_of_long_calls_are_rare() {
        let seconds = choices(30, 5_000_000, |_| 3_000_000);
        assert_eq!(seconds[..3], [false, true, false]);
        assert_eq!(seconds.iter().skip(3).filter(|&&is_alone| !is_alone).count(), 1);
    }
}
