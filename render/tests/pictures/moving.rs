//! GIFs show every state at the right time.

use gif::{ColorOutput, DecodeOptions};
use pogema_core::Trace;
use pogema_render::{Color, Colors, Ground, Style, gif as gifs, raster};

use crate::{played, still};

/// Every frame of a GIF as a viewer shows it, with its delay. Units: hundredths of a second.
struct Shown {
    width: usize,
    frames: Vec<(Vec<u8>, u16)>,
}

impl Shown {
    fn of(bytes: &[u8]) -> Self {
        let mut options = DecodeOptions::new();
        options.set_color_output(ColorOutput::RGBA);
        let mut decoder = options.read_info(bytes).unwrap();
        assert_eq!(decoder.repeat(), gif::Repeat::Infinite);
        let (width, height) = (usize::from(decoder.width()), usize::from(decoder.height()));
        let mut canvas = vec![0; width * height * 4];
        let mut frames = Vec::new();
        while let Some(frame) = decoder.read_next_frame().unwrap() {
            let across = usize::from(frame.width);
            for (at, pixel) in frame.buffer.chunks(4).enumerate() {
                let (row, col) =
                    (at / across + usize::from(frame.top), at % across + usize::from(frame.left));
                if pixel[3] == 255 {
                    canvas[(row * width + col) * 4..][..4].copy_from_slice(pixel);
                }
            }
            frames.push((canvas.clone(), frame.delay));
        }
        Self { width, frames }
    }

    /// Returns the frame at a time. Units: hundredths of a second.
    fn at(&self, time: u32) -> &[u8] {
        let mut until = 0;
        let frame = self.frames.iter().find(|(_, delay)| {
            until += u32::from(*delay);
            time < until
        });
        &frame.unwrap().0
    }

    fn pixel(&self, time: u32, row: usize, col: usize) -> Color {
        let at = (row * self.width + col) * 4;
        let picture = self.at(time);
        Color([picture[at], picture[at + 1], picture[at + 2]])
    }
}

fn encode(trace: &Trace, style: &Style, width: u32) -> Shown {
    let (mut last_done, mut last_total) = (0, 0);
    let bytes = gifs::encode(trace, style, width, &mut |done, total| {
        assert_eq!(done, last_done + 1);
        (last_done, last_total) = (done, total);
    });
    assert_eq!(last_done, last_total);
    Shown::of(&bytes.unwrap())
}

#[test]
fn every_state_is_shown_at_its_time() {
    for (on_target, step_time) in [("finish", 0.25), ("nothing", 0.1), ("restart", 0.13), ("restart", 0.02)] {
        let trace = played(&format!(
            "{{size: 7, num_agents: 5, seed: 3, on_target: {on_target}, max_episode_steps: 20}}"
        ));
        let shown = encode(&trace, &Style { step_time, ..Style::default() }, 200);
        let duration: u32 = shown.frames.iter().map(|(_, delay)| u32::from(*delay)).sum();
        assert_eq!(duration, ((trace.steps.len() + 2) as f64 * step_time * 100.0).round() as u32);
        for (frame, state) in trace.states().enumerate() {
            let time = ((frame + 1) as f64 * step_time * 100.0).round() as u32;
            for agent in 0..5 {
                let cell = state.cells[agent];
                let (row, col) = (usize::from(cell.row), usize::from(cell.col));
                let found = shown.pixel(time, (row + 2) * 20, (col + 2) * 20);
                let expected =
                    if state.active[agent] { Colors::default().agents[agent] } else { Color::WHITE };
                let is_taken = (0..5).any(|other| state.active[other] && state.cells[other] == cell);
                if state.active[agent] || !is_taken {
                    assert_eq!(found, expected, "{on_target}: agent {agent} at frame {frame}");
                }
            }
        }
    }
}

#[test]
fn agents_move_smoothly_between_cells() {
    let mut trace = still(&["..", ".."], &[([0, 0], [1, 0])]);
    let mut state = trace.start.state.clone();
    state.cells[0] = [0, 1].into();
    trace.steps.push(pogema_core::TraceStep {
        actions: vec![pogema_core::Action::Right],
        state,
        rewards: vec![0.0],
        terminated: vec![false],
        truncated: vec![false],
        observations: None,
        metrics: None,
    });
    let shown = encode(&trace, &Style { show_lines: false, ..Style::default() }, 100);
    // A step takes five frames. The GIF holds the start, shows four frames in between, and holds the end.
    assert_eq!(shown.frames.iter().map(|(_, delay)| *delay).collect::<Vec<_>>(), [30, 5, 5, 5, 5, 25]);
    let centre = |time: u32| {
        let is_red = |col: &usize| shown.pixel(time, 40, *col) == Colors::default().agents[0];
        let (first, last) = ((0..100).find(is_red).unwrap(), (0..100).rfind(is_red).unwrap());
        (first + last).div_ceil(2)
    };
    assert_eq!([0, 30, 35, 40, 45, 50].map(centre), [40, 44, 48, 52, 56, 60]);
}

#[test]
fn a_still_episode_is_one_frame() {
    let trace = played("{size: 5, num_agents: 2, seed: 1}").part(0..=0).unwrap();
    let shown = encode(&trace, &Style::default(), 100);
    assert_eq!(shown.frames.iter().map(|(_, delay)| *delay).collect::<Vec<_>>(), [50]);
}

#[test]
fn a_frame_longer_than_the_longest_gif_delay_is_split() {
    let trace = still(&[".."], &[([0, 0], [0, 1])]);
    let shown = encode(&trace, &Style { step_time: 400.0, ..Style::default() }, 20);
    assert_eq!(shown.frames.iter().map(|(_, delay)| *delay).collect::<Vec<_>>(), [65_535, 14_465]);
    assert_eq!(shown.frames[0].0, shown.frames[1].0);
}

#[test]
fn numbers_have_the_colors_of_a_png() {
    let agents: Vec<_> = (0..24).map(|at| ([at / 6, at % 6], [4, at % 6])).collect();
    let trace = still(&["......"; 5], &agents);
    let style = Style { show_numbers: true, ..Style::default() };
    let shown = encode(&trace, &style, 9 * 40);
    let still = Style { static_frame: Some(0), ..style };
    let bytes = raster::png(&trace, &still, 9 * 40).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let mut picture = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut picture).unwrap();
    for (agent, (cell, _)) in agents.iter().enumerate() {
        let [row, col] = cell.map(|at| (usize::from(at) + 2) * 40);
        for (row, col) in (row - 9..row + 9).flat_map(|row| (col - 9..col + 9).map(move |col| (row, col))) {
            let expected = &picture[(row * shown.width + col) * 4..][..3];
            let Color(found) = shown.pixel(0, row, col);
            let distance = found.iter().zip(expected).map(|(one, other)| one.abs_diff(*other)).max().unwrap();
            assert!(distance <= 24, "agent {agent}: ({row}, {col}) is {found:?}, expected {expected:?}");
        }
    }
}

#[test]
fn every_agent_may_have_its_own_color() {
    let agents: Vec<_> = (0..64).map(|at| (([at / 8, at % 8]), [0, 0])).collect();
    let trace = still(&["........"; 8], &agents);
    let colors = (0..64_u8).map(|at| Color([at * 4, 255 - at * 4, 128])).collect();
    let style = Style { colors: Colors { agents: colors, ..Colors::default() }, ..Style::default() };
    let shown = encode(&trace, &style, 220);
    for (agent, expected) in style.colors.agents.iter().enumerate() {
        let found = shown.pixel(0, (agent / 8 + 2) * 20, (agent % 8 + 2) * 20);
        let distance = (0..3).map(|at| found.0[at].abs_diff(expected.0[at])).max().unwrap();
        assert!(distance <= 8, "agent {agent} is {found}, expected {expected}");
    }
}

#[test]
fn a_view_keeps_seen_obstacles_visible() {
    let trace = played(
        "{size: 12, num_agents: 3, seed: 3, obs_radius: 2, on_target: restart, max_episode_steps: 20}",
    );
    let shown = encode(&trace, &Style { egocentric: Some(1), ..Style::default() }, 15 * 20);
    let ground = Ground::of(&trace);
    let cells: Vec<_> = (-1..13).flat_map(|row| (-1..13).map(move |col| (row, col))).collect();
    let mut num_seen = Vec::new();
    for frame in 0..=trace.steps.len() {
        let sees =
            |row, col| trace.states().take(frame + 1).any(|state| ground.sees(state.cells[1], row, col));
        let obstacles = cells.iter().filter(|(row, col)| ground.is_obstacle(*row, *col));
        let mut count = 0;
        for &(row, col) in obstacles {
            let [y, x] = [row, col].map(|at| (at + 2) as usize * 20);
            let Color([red, ..]) = shown.pixel((frame + 1) as u32 * 25, y, x);
            // Red is 132 for an obstacle and 230 for a shaded one, at opacity 0.2 on white; the palette rounds both.
            let expected: u8 = if sees(row, col) { 132 } else { 230 };
            assert!(
                red.abs_diff(expected) < 8,
                "({row}, {col}) at frame {frame} is {red}, expected {expected}"
            );
            count += usize::from(sees(row, col));
        }
        num_seen.push(count);
    }
    assert!(num_seen[0] < num_seen[trace.steps.len()]);
}
