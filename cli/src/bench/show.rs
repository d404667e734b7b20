//! Formats the results of `pogema bench` as tables.

use comfy_table::Table;
use pogema_toolbox::fitted;

use crate::output::markdown_table;

use super::{Row, Target};

/// Returns the table of speeds and the table of targets as Markdown.
pub fn tables(machine: &str, path: &str, rows: &[Row], targets: &[Target]) -> String {
    let (speeds, targets) = (fitted(speeds(rows)), fitted(target_table(targets)));
    format!(
        "{machine}; observations by the {path} path; windows of 11 x 11, density 0.3, random actions\n\n\
         Millions per second: agent steps, observations, both; buffers filled with zeros\n\n{speeds}\n\n\
         {targets}"
    )
}

fn speeds(rows: &[Row]) -> Table {
    let mut table = markdown_table(
        "work | step | f32 | u8 | bits | step + f32 | step + u8 | zeros f32 | zeros u8 | f32 of zeros | POGEMA | times | reset",
    );
    for row in rows {
        let speed = &row.speed;
        let millions = [
            speed.step,
            speed.f32,
            speed.u8,
            speed.bits,
            speed.step_f32,
            speed.step_u8,
            speed.fill_f32,
            speed.fill_u8,
        ];
        let mut cells = vec![row.name.clone()];
        cells.extend(millions.map(|rate| figure(rate / 1e6)));
        cells.push(format!("{:.0} %", 100.0 * speed.f32 / speed.fill_f32));
        let peer = row.pogema.map(|peer| (peer.observations, speed.step_f32 / peer.observations));
        cells.push(peer.map_or_else(String::new, |(theirs, _)| format!("{:.3}", theirs / 1e6)));
        cells.push(peer.map_or_else(String::new, |(_, times)| format!("{times:.0}")));
        cells.push(seconds(1.0 / speed.reset));
        table.add_row(cells);
    }
    table
}

fn target_table(targets: &[Target]) -> Table {
    let mut table = markdown_table("target | required | measured | met");
    for target in targets {
        let sign = if target.is_upper_bound { "at most" } else { "at least" };
        let met = match target.is_met() {
            Some(true) => "yes",
            Some(false) => "no",
            None => "not measured",
        };
        let got = target.got.map_or_else(String::new, figure);
        table.add_row([target.name.clone(), format!("{sign} {}", target.want), got, met.into()]);
    }
    table
}

fn figure(number: f64) -> String {
    if number >= 100.0 { format!("{number:.0}") } else { format!("{number:.2}") }
}

fn seconds(time: f64) -> String {
    match time {
        _ if time >= 1.0 => format!("{time:.2} s"),
        _ if time >= 1e-3 => format!("{:.2} ms", time * 1e3),
        _ => format!("{:.1} us", time * 1e6),
    }
}
