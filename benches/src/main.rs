//! The speed table: our time and POGEMA's for the same work, one after the other on the same machine.
//!
//! ```text
//! cargo run --release -p pogema-benches            # minutes
//! cargo run --release -p pogema-benches -- --full  # with the largest sizes, on which POGEMA takes minutes each
//! ```

use std::hint::black_box;
use std::path::Path;
use std::process::{Command, ExitCode};
use std::time::Instant;

use comfy_table::{CellAlignment, Table, presets};
use pogema_conformance::find_oracle_python;
use pogema_core::Error;
use pogema_maps::{GridConfig, InstanceSource};
use serde_json::json;

/// Side of the map, agents, and how often each program repeats the work.
const SIZES: [(usize, usize, u32); 3] = [(32, 64, 30), (256, 10_000, 5), (1024, 100_000, 1)];
const FULL_SIZES: [(usize, usize, u32); 1] = [(3072, 1_000_000, 1)];

fn main() -> ExitCode {
    let is_full = match std::env::args().nth(1).as_deref() {
        None => false,
        Some("--full") => true,
        Some(other) => {
            eprintln!("error: unknown argument `{other}`, expected `--full` or none");
            return ExitCode::from(2);
        }
    };
    match measure(is_full) {
        Ok(table) => {
            println!("{table}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

fn measure(is_full: bool) -> Result<Table, Error> {
    let python = find_oracle_python(Path::new("target/oracle"))?;
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN).set_header([
        "reset with",
        "POGEMA 1.4.0",
        "pogema-rs",
        "times faster",
    ]);
    let sizes = SIZES.iter().chain(FULL_SIZES.iter().filter(|_| is_full));
    for &(side, num_agents, repeats) in sizes {
        let theirs = time_pogema(&python, side, num_agents, repeats)?;
        let ours = time_ours(side, num_agents, repeats.max(3))?;
        let work = format!("{num_agents} agents on {side} x {side}");
        table.add_row([work, seconds(theirs), seconds(ours), format!("{:.0}", theirs / ours)]);
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    Ok(table)
}

fn time_ours(side: usize, num_agents: usize, repeats: u32) -> Result<f64, Error> {
    let fields = json!({"size": side, "density": 0.3, "num_agents": num_agents, "seed": 0});
    let mut source = InstanceSource::new(GridConfig::from_value(&fields)?, None)?;
    let mut best = f64::INFINITY;
    for _ in 0..repeats {
        let start = Instant::now();
        black_box(source.generate()?);
        best = best.min(start.elapsed().as_secs_f64());
    }
    Ok(best)
}

fn time_pogema(python: &Path, side: usize, num_agents: usize, repeats: u32) -> Result<f64, Error> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("peers/placement.py");
    let output = Command::new(python)
        .arg(script)
        .args([side.to_string(), num_agents.to_string(), repeats.to_string()])
        .output()
        .map_err(|error| Error::io(python, error))?;
    let text = String::from_utf8_lossy(&output.stdout);
    text.trim()
        .parse()
        .map_err(|_| Error::io(python, String::from_utf8_lossy(&output.stderr).trim().to_owned()))
}

fn seconds(time: f64) -> String {
    if time < 1.0 { format!("{:.3} ms", time * 1e3) } else { format!("{time:.2} s") }
}
