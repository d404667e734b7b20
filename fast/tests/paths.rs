//! Every SIMD path of this machine writes the same values as the scalar path, at every alignment of the buffer, and
//! writes nothing outside the buffer.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::ffi::{OsStr, OsString};
use std::process::Command;

use pogema_core::{Cell, Collision, Config, Environment, GoalStream, Instance, Map, Outside};
use pogema_fast::{Engine, SimdPath, Value, words_per_agent};

const MAX_AGENTS: usize = 70;
const MAX_OFFSET: usize = 70;

/// Returns an instance with agents spread over a map whose columns lie in several strips.
fn instance(num_agents: usize) -> Instance {
    let (height, width) = (24, 75);
    let obstacles = (0..height * width).map(|index| index * index % 13 < 4).collect();
    let map = Map::new(height, width, obstacles).unwrap();
    // 1009 and the number of cells are coprime, so no cell occurs twice.
    let cell = |index: usize| map.cell_at(index * 1009 % (height * width));
    let starts: Vec<Cell> = (0..num_agents).map(cell).collect();
    let goals = (0..num_agents).map(|agent| GoalStream::single(cell(agent * 3 + 5))).collect();
    Instance::new(map, Outside::Free, starts, goals).unwrap()
}

fn engine(num_agents: usize, radius: usize, path: SimdPath) -> Engine {
    let config = Config { num_agents, radius, collision: Collision::Soft, ..Config::default() };
    let mut engine = Engine::with_path(config, path).unwrap();
    engine.start(instance(num_agents)).unwrap();
    engine
}

/// Writes into the part of a buffer that begins at index `offset`, and checks the whole buffer.
fn check_part<V: Value + From<u8>>(engine: &Engine, expected: &[u8], offset: usize, about: &str) {
    let num_agents = engine.config().num_agents;
    let untouched = V::from(9);
    let mut buffer = vec![untouched; offset + expected.len() + MAX_OFFSET];
    engine.observe_agents(0..num_agents, &mut buffer[offset..offset + expected.len()]).unwrap();
    let (before, rest) = buffer.split_at(offset);
    let (values, after) = rest.split_at(expected.len());
    assert!(before.iter().chain(after).all(|&value| value == untouched), "{about}: wrote outside the buffer");
    let wrong = values.iter().zip(expected).position(|(&value, &byte)| value != V::from(byte));
    assert_eq!(wrong, None, "{about}: index of the first wrong value");
}

fn check_parts(num_agents: usize, radius: usize, offset: usize) {
    let mut expected = vec![9; num_agents * 3 * (2 * radius + 1).pow(2)];
    engine(num_agents, radius, SimdPath::Scalar).observe_agents(0..num_agents, &mut expected).unwrap();
    for path in SimdPath::available() {
        let engine = engine(num_agents, radius, path);
        let about = format!("{path}, {num_agents} agents, radius {radius}, offset {offset}");
        check_part::<u8>(&engine, &expected, offset, &about);
        check_part::<f32>(&engine, &expected, offset, &about);
    }
}

#[test]
fn paths_write_the_same_at_every_alignment() {
    for radius in 1..=20 {
        for offset in 0..=MAX_OFFSET {
            // Every number of agents occurs with every radius.
            check_parts(1 + (offset * 13 + radius) % MAX_AGENTS, radius, offset);
        }
    }
}

#[test]
fn paths_write_the_same_windows_of_large_radius() {
    for (radius, most_agents) in [(33, 7), (64, 4), (128, 2)] {
        for offset in 0..=MAX_OFFSET {
            check_parts(1 + offset % most_agents, radius, offset);
        }
    }
}

/// Tests more agents than fit in one block, and buffers that are written with stores that bypass the cache.
#[test]
fn paths_write_the_same_into_buffers_beyond_the_cache() {
    for (num_agents, offset) in [(90, 0), (90, 5), (345, 0), (345, 5)] {
        check_parts(num_agents, 128, offset);
    }
}

#[test]
fn paths_write_the_same_bits_of_any_agents() {
    for radius in (1..=20).chain([33, 64, 128]) {
        let per_agent = words_per_agent(radius);
        let mut expected = vec![u64::MAX; MAX_AGENTS * per_agent];
        engine(MAX_AGENTS, radius, SimdPath::Scalar).observe_bits(0..MAX_AGENTS, &mut expected).unwrap();
        for path in SimdPath::available() {
            let engine = engine(MAX_AGENTS, radius, path);
            for (first, last) in [(0, MAX_AGENTS), (0, 0), (0, 1), (13, 14), (69, 70), (70, 70), (5, 68)] {
                let mut got = vec![u64::MAX; (last - first) * per_agent + 2];
                engine.observe_bits(first..last, &mut got[1..=(last - first) * per_agent]).unwrap();
                let (got, after) = got.split_at((last - first) * per_agent + 1);
                let about = format!("{path}, agents {first}..{last}, radius {radius}");
                assert_eq!(got[1..], expected[first * per_agent..last * per_agent], "{about}");
                assert_eq!((got[0], after), (u64::MAX, [u64::MAX].as_slice()), "{about}");
            }
        }
    }
}

/// If this environment variable is set, the test below runs in a child process and only prints its path or the error.
const IS_CHILD: &str = "POGEMA_FAST_TEST_CHILD";

#[test]
fn pogema_simd_selects_a_path_or_is_rejected() {
    if std::env::var_os(IS_CHILD).is_some() {
        let made = Engine::new(Config::default()).map(|_| ());
        let path = SimdPath::from_environment();
        assert_eq!(path.as_ref().err(), made.as_ref().err());
        println!("<{}>", path.map_or_else(|error| error.to_string(), |path| path.to_string()));
        return;
    }
    assert_eq!(child(None), SimdPath::best().to_string());
    for path in SimdPath::ALL {
        let unavailable =
            format!("`POGEMA_SIMD` is `{path}`, expected at most `{}` on this machine", SimdPath::best());
        let expected = if path.is_available() { path.to_string() } else { unavailable };
        assert_eq!(child(Some(path.to_string().as_ref())), expected);
    }
    for name in ["", "AVX2", "sse", "scalar ", "avx512,avx2"] {
        let expected = format!("`POGEMA_SIMD` is `{name}`, expected `scalar`, `avx2` or `avx512`");
        assert_eq!(child(Some(name.as_ref())), expected);
    }
}

#[cfg(unix)]
#[test]
fn a_variable_that_is_not_text_is_an_error() {
    use std::os::unix::ffi::OsStringExt;
    let name = OsString::from_vec(vec![b'a', 0xff]);
    let expected = "`POGEMA_SIMD` is `a\u{fffd}`, expected `scalar`, `avx2` or `avx512`";
    assert_eq!(child(Some(&name)), expected);
}

/// Returns the path or error that a child process prints with this value of the variable.
fn child(variable: Option<&OsStr>) -> String {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", "pogema_simd_selects_a_path_or_is_rejected", "--nocapture"]);
    command.env(IS_CHILD, "1").env_remove(SimdPath::VARIABLE);
    if let Some(value) = variable {
        command.env(SimdPath::VARIABLE, value);
    }
    let output = command.output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{text}");
    let (_, answer) = text.split_once('<').unwrap();
    answer.split_once('>').unwrap().0.to_owned()
}
