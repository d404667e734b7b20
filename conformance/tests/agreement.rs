//! Checks that the engines agree with the recordings and with each other on episodes with every kind of conflict, and
//! that a wrong engine is caught under the rule it breaks.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::sync::atomic::AtomicBool;

use pogema_conformance::{NamedEngine, Report, Watch, cases, golden};
use pogema_core::{Action, Collision, Config, Environment, Error, OnGoal, Reward};
use pogema_core::{Instance, Occupancy, Snapshot, State, StepOut};
use pogema_reference::Reference;

#[test]
fn engines_agree_with_the_recordings() {
    let engines = [NamedEngine::REFERENCE, NamedEngine::LITERAL];
    let mut report = Report::default();
    report.check_recordings("golden", &golden::folder(), &engines, Watch::default()).unwrap();
    report.check_recordings("found", &golden::found_folder(), &engines, Watch::default()).unwrap();
    assert!(report.agrees(), "{}", report.failures[0].text);
    assert_eq!(num_checked(&report)[..2], [("golden, reference", 3572), ("golden, literal", 3572)]);
}

#[test]
fn a_stopped_run_checks_no_more_recordings_and_cases() {
    let stop = AtomicBool::new(true);
    let watch = Watch { stop: &stop, ..Watch::default() };
    let mut report = Report::default();
    report.check_recordings("golden", &golden::folder(), &[NamedEngine::REFERENCE], watch).unwrap();
    report.check_cases("cases", &cases::folder(), &[NamedEngine::REFERENCE], watch).unwrap();
    assert_eq!(num_checked(&report), [("golden, reference", 0), ("cases, reference", 0)]);
}

/// Returns each part with the number of its recordings or cases.
fn num_checked(report: &Report) -> Vec<(&str, u64)> {
    report.parts.iter().map(|part| (&*part.name, part.checked)).collect()
}

fn fresh(engines: &[NamedEngine], num_cases: u64) -> Report {
    let keep = tempfile::tempdir().unwrap();
    let mut report = Report::default();
    report.check_fresh(engines, num_cases, 77, keep.path(), Watch::default()).unwrap();
    report
}

#[test]
fn engines_agree_on_crowded_episodes_of_every_kind() {
    let report = fresh(&[NamedEngine::REFERENCE, NamedEngine::LITERAL], 1500);
    assert!(report.agrees(), "{}", report.failures[0].text);
    for (name, count) in report.events.named() {
        let least = if name == "cycles" { 50 } else { 500 };
        assert!(count >= least, "only {count} {name}, expected at least {least}");
    }
}

/// The reference with one error.
struct Wrong {
    inner: Reference,
    config: Config,
    after_step: fn(&mut StepOut<'_>, &Snapshot),
    observe: fn(&mut [f32]),
}

impl Wrong {
    fn make(
        config: Config,
        bend: fn(Config) -> Config,
        after_step: fn(&mut StepOut<'_>, &Snapshot),
        observe: fn(&mut [f32]),
    ) -> Result<Box<dyn Environment>, Error> {
        Ok(Box::new(Self { inner: Reference::new(bend(config))?, config, after_step, observe }))
    }

    fn rules(config: Config, bend: fn(Config) -> Config) -> Result<Box<dyn Environment>, Error> {
        Self::make(config, bend, |_, _| (), |_| ())
    }
}

impl Environment for Wrong {
    fn config(&self) -> &Config {
        &self.config
    }
    fn reset(&mut self, instance: &Instance) -> Result<(), Error> {
        self.inner.reset(instance)
    }
    fn step(&mut self, actions: &[Action], mut out: StepOut<'_>) -> Result<(), Error> {
        let inner = StepOut { rewards: out.rewards, terminated: out.terminated, truncated: out.truncated };
        self.inner.step(actions, inner)?;
        (self.after_step)(&mut out, &self.inner.snapshot());
        Ok(())
    }
    fn restore(&mut self, step: u64, state: &Snapshot) -> Result<(), Error> {
        self.inner.restore(step, state)
    }
    fn state(&self) -> State<'_> {
        self.inner.state()
    }
    fn occupied(&self) -> Vec<pogema_core::Cell> {
        self.inner.occupied()
    }
    fn observe(&self, out: &mut [f32]) -> Result<(), Error> {
        self.inner.observe(out)?;
        (self.observe)(out);
        Ok(())
    }
    fn observe_map(&self, out: &mut [u8]) -> Result<(), Error> {
        self.inner.observe_map(out)
    }
}

/// The rule under which each wrong engine must be caught, and the engine.
const WRONG: [(&str, NamedEngine); 8] = [
    (
        "occupancy/as-released",
        NamedEngine {
            name: "shows every agent",
            make: |config| Wrong::rules(config, |config| Config { occupancy: Occupancy::Exact, ..config }),
        },
    ),
    (
        "collide/priority",
        NamedEngine {
            name: "blocks both",
            make: |config| {
                Wrong::rules(config, |config| match config.collision {
                    Collision::Priority => Config { collision: Collision::BlockBoth, ..config },
                    _ => config,
                })
            },
        },
    ),
    (
        "collide/soft",
        NamedEngine {
            name: "uses priority",
            make: |config| Wrong::rules(config, |config| Config { collision: Collision::Priority, ..config }),
        },
    ),
    (
        "goal/finish",
        NamedEngine {
            name: "keeps finished agents",
            make: |config| {
                Wrong::rules(config, |config| match config.on_goal {
                    OnGoal::Finish => Config { on_goal: OnGoal::Nothing, ..config },
                    _ => config,
                })
            },
        },
    ),
    (
        "reward/own",
        NamedEngine {
            name: "shares rewards",
            make: |config| Wrong::rules(config, |config| Config { reward: Reward::Shared, ..config }),
        },
    ),
    (
        "end/truncated",
        NamedEngine {
            name: "truncates late",
            make: |config| {
                Wrong::rules(config, |config| Config { max_steps: config.max_steps.max(1) + 1, ..config })
            },
        },
    ),
    (
        "end/terminated",
        NamedEngine {
            name: "terminates the first agent",
            make: |config| Wrong::make(config, |config| config, |out, _| out.terminated[0] = true, |_| ()),
        },
    ),
    (
        "observe/default",
        NamedEngine {
            name: "flips one observed value",
            make: |config| Wrong::make(config, |config| config, |_, _| (), |seen| seen[0] = 1.0 - seen[0]),
        },
    ),
];

#[test]
fn wrong_engines_are_caught_under_the_rule_they_break() {
    for (rule, engine) in WRONG {
        let report = fresh(&[NamedEngine::REFERENCE, engine], 200);
        let blamed = report.tally.rules.get(rule).map_or(0, |count| count.diverged);
        assert!(blamed > 0, "an engine that {} was not caught under {rule}", engine.name);
        let kept = report.failures.iter().all(|fault| fault.kept.is_some());
        assert!(kept, "divergences of an engine that {} were not kept", engine.name);
    }
}
