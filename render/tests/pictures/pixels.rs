//! PNG pictures show the state and look like the SVG.

use pogema_core::{Cell, Trace};
use pogema_render::{Border, Color, Colors, Ground, Style, raster, svg};
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg;

use crate::{played, still};

struct Picture {
    width: usize,
    height: usize,
    data: Vec<u8>,
}

impl Picture {
    fn of(bytes: &[u8]) -> Self {
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut data = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut data).unwrap();
        assert_eq!(info.color_type, png::ColorType::Rgba);
        Self { width: info.width as usize, height: info.height as usize, data }
    }

    fn pixel(&self, row: f64, col: f64) -> Color {
        let at = (row as usize * self.width + col as usize) * 4;
        assert_eq!(self.data[at + 3], 255);
        Color([self.data[at], self.data[at + 1], self.data[at + 2]])
    }
}

/// Side of a cell. Units: pixels.
const CELL: f64 = 20.0;

fn draw(trace: &Trace, style: &Style) -> Picture {
    let cols = Ground::of(trace).cols(style.border).len() + 1;
    Picture::of(&raster::png(trace, style, (cols as f64 * CELL) as u32).unwrap())
}

#[test]
fn pixels_show_the_content_of_each_cell() {
    for (seed, frame) in [(1, 0), (2, 3), (3, 9)] {
        let trace = played(&format!("{{size: 9, num_agents: 12, seed: {seed}, density: 0.2}}"));
        let style = Style { static_frame: Some(frame), ..Style::default() };
        let (picture, state) = (draw(&trace, &style), trace.state(frame).unwrap());
        assert_eq!((picture.width, picture.height), (240, 240));
        let colors = Colors::default();
        let color_of = |agent: usize| colors.agents[agent];
        for (row, col) in (-1..10).flat_map(|row| (-1..10).map(move |col| (row, col))) {
            // The margin is half a cell and the border one cell.
            let (y, x) = ((f64::from(row) + 2.0) * CELL, (f64::from(col) + 2.0) * CELL);
            let here = |cells: &[Cell]| {
                let is_here = |agent: &usize| {
                    state.active[*agent]
                        && i32::from(cells[*agent].row) == row
                        && i32::from(cells[*agent].col) == col
                };
                (0..12).find(is_here)
            };
            let middle = match here(&state.cells) {
                Some(agent) => color_of(agent),
                None if Ground::of(&trace).is_obstacle(row, col) => colors.obstacle,
                None => Color::WHITE,
            };
            assert_eq!(picture.pixel(y, x), middle, "({row}, {col})");
            // An agent is drawn above the goals.
            if let Some(agent) = here(&state.goals).filter(|_| here(&state.cells).is_none()) {
                assert_eq!(
                    picture.pixel(y, x + 0.35 * CELL - 0.1),
                    color_of(agent),
                    "goal at ({row}, {col})"
                );
            }
            let line = picture.pixel(y, x - CELL / 2.0);
            // Two fifths of the colour of obstacles, on white.
            let pale = colors.obstacle.0.map(|part| (255.0 - 0.4 * (255.0 - f64::from(part))).round() as u8);
            assert_eq!(line, Color(pale), "line left of ({row}, {col})");
        }
    }
}

/// Renders an SVG on white with resvg, which rasterizes with the same library as [`raster`].
fn rendered(svg: &str, width: u32, height: u32) -> Vec<u8> {
    let tree = usvg::Tree::from_str(svg, &usvg::Options::default()).unwrap();
    let mut canvas = Pixmap::new(width, height).unwrap();
    canvas.fill(resvg::tiny_skia::Color::WHITE);
    let view = tree.size();
    let transform = Transform::from_scale(width as f32 / view.width(), height as f32 / view.height());
    resvg::render(&tree, transform, &mut canvas.as_mut());
    canvas.data().to_vec()
}

#[test]
fn png_and_svg_look_alike() {
    let trace =
        played("{size: 8, num_agents: 6, seed: 4, obs_radius: 2, on_target: nothing, max_episode_steps: 12}");
    for frame in [0, 7] {
        for egocentric in [None, Some(2)] {
            for (border, show_lines) in [(Border::None, true), (Border::Thin, false), (Border::Full, true)] {
                let style =
                    Style { static_frame: Some(frame), egocentric, border, show_lines, ..Style::default() };
                let picture = draw(&trace, &style);
                let other = rendered(
                    &svg::draw(&trace, &style).unwrap(),
                    picture.width as u32,
                    picture.height as u32,
                );
                let far =
                    picture.data.iter().zip(&other).filter(|(one, other)| one.abs_diff(**other) > 40).count();
                // Pixels on the edges of shapes may differ.
                assert!(far * 500 < other.len(), "{far} of {} for {style:?}", other.len());
            }
        }
    }
}

#[test]
fn one_cell_and_no_agents_can_be_drawn() {
    let mut trace = still(&["."], &[([0, 0], [0, 0])]);
    assert_eq!(draw(&trace, &Style { border: Border::None, ..Style::default() }).height, 40);
    trace.start.state.active[0] = false;
    let empty = draw(&trace, &Style::default());
    assert_eq!(empty.pixel(2.0 * CELL, 2.0 * CELL), Color::WHITE);
}

#[test]
fn a_picture_has_the_requested_width_and_the_proportions_of_its_map() {
    let trace = still(&["....", "...."], &[([0, 0], [0, 1])]);
    for width in [1, 7, 700] {
        let picture = Picture::of(&raster::png(&trace, &Style::default(), width).unwrap());
        assert_eq!((picture.width, picture.height), (width as usize, (width as usize * 5).div_ceil(7)));
    }
    let width_for = |longer| raster::width_for(&trace, &Style::default(), longer);
    assert_eq!([700, 699, 13, 7, 6, 1].map(width_for), [700, 693, 7, 7, 6, 1]);
    let high = still(&["..", "..", "..", ".."], &[([0, 0], [0, 1])]);
    assert_eq!(raster::width_for(&high, &Style::default(), 700), 500);
}
