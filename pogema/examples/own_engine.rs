//! Checks your own engine with the conformance kit, which plays random episodes on it and on the reference and compares
//! every array.

use pogema::reference::Reference;
use pogema::{Action, Cell, Config, Environment, Error, Instance, Snapshot, State, StepOut};
use pogema_conformance::{NamedEngine, Report, Watch};

/// Your engine. This one delegates to the reference. If `is_wrong` is set, it has a bug: the first agent never moves
/// up.
struct Mine {
    inner: Reference,
    is_wrong: bool,
}

impl Environment for Mine {
    fn config(&self) -> &Config {
        self.inner.config()
    }

    fn reset(&mut self, instance: &Instance) -> Result<(), Error> {
        self.inner.reset(instance)
    }

    fn step(&mut self, actions: &[Action], out: StepOut<'_>) -> Result<(), Error> {
        let mut actions = actions.to_vec();
        match actions.first_mut() {
            Some(action) if self.is_wrong && *action == Action::Up => *action = Action::Stay,
            _ => {}
        }
        self.inner.step(&actions, out)
    }

    fn restore(&mut self, step: u64, state: &Snapshot) -> Result<(), Error> {
        self.inner.restore(step, state)
    }

    fn state(&self) -> State<'_> {
        self.inner.state()
    }

    fn occupied(&self) -> Vec<Cell> {
        self.inner.occupied()
    }

    fn observe(&self, out: &mut [f32]) -> Result<(), Error> {
        self.inner.observe(out)
    }

    fn observe_map(&self, out: &mut [u8]) -> Result<(), Error> {
        self.inner.observe_map(out)
    }
}

/// Plays 200 random episodes. The kit keeps counterexamples in a folder, which this example removes.
fn check(engine: NamedEngine) -> Result<Report, Error> {
    let mut report = Report::default();
    let folder = tempfile::tempdir().map_err(|error| Error::external("temporary folder", error))?;
    report.check_fresh(&[NamedEngine::REFERENCE, engine], 200, 1, folder.path(), Watch::default())?;
    Ok(report)
}

pub(crate) fn main() -> Result<(), Error> {
    let make = |config| {
        Ok(Box::new(Mine { inner: Reference::new(config)?, is_wrong: false }) as Box<dyn Environment>)
    };
    let report = check(NamedEngine { name: "mine", make })?;
    println!("right: {} of 200 episodes differ", report.failures.len());
    assert!(report.agrees());

    let make = |config| {
        Ok(Box::new(Mine { inner: Reference::new(config)?, is_wrong: true }) as Box<dyn Environment>)
    };
    let report = check(NamedEngine { name: "mine", make })?;
    println!(
        "wrong: {} of 200 episodes differ; the first:\n{}",
        report.failures.len(),
        report.failures[0].text
    );
    assert!(!report.agrees());
    Ok(())
}
