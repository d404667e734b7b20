//! Fuzzes the answers of a port: each is compared or reported as misbehaviour, and none causes a panic.
#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use pogema_conformance::port::{Ask, FaultKind, Hello, Link, Misbehaviour, Mode, Reply, judge};
use pogema_conformance::{Op, Request, Response, play};
use serde_json::json;

/// A port that answers with the lines of the input, in order.
struct Lines<'a>(std::slice::Split<'a, u8, fn(&u8) -> bool>);

impl Lines<'_> {
    fn read<T: serde::de::DeserializeOwned>(&mut self) -> Result<T, Misbehaviour> {
        let line = self.0.next().ok_or_else(|| Misbehaviour::new(FaultKind::Other("the end".into()), ""))?;
        serde_json::from_slice(line).map_err(|error| Misbehaviour::new(FaultKind::Other(error.to_string()), ""))
    }
}

impl Link for Lines<'_> {
    fn hello(&mut self) -> Result<Hello, Misbehaviour> {
        self.read()
    }

    fn ask(&mut self, _: &Ask) -> Result<Reply, Misbehaviour> {
        self.read()
    }
}

static EXPECTED: LazyLock<(Request, Response)> = LazyLock::new(|| {
    let config = json!({
        "map": "a.b\nB.A", "obs_radius": 1, "collision_system": "soft", "observation_type": "default",
    });
    let ops = vec![Op::Reset(None), Op::Step(vec![4, 3]), Op::Step(vec![2, 2])];
    let request = Request { config, ops, ..Request::default() };
    let expected = play(&request);
    (request, expected)
});

fuzz_target!(|text: &[u8]| {
    let (request, expected) = &*EXPECTED;
    let mut lines = Lines(text.split((|&byte| byte == b'\n') as fn(&u8) -> bool));
    let Ok(hello) = lines.hello() else { return };
    for mode in [Mode::Instance, Mode::Config] {
        let judged = judge(&mut lines, &hello, mode, request, expected);
        assert!(judged.fault.is_none() || judged.divergences.is_empty());
    }
});
