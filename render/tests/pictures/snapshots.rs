//! Snapshots of small pictures, for review by eye after changes.

use pogema_render::{Border, Ground, Style, svg, text};

use crate::{played, still};

#[test]
fn a_small_map_as_text() {
    let trace = played("{size: 6, num_agents: 3, seed: 1, obs_radius: 2}");
    let draw = |border, view| {
        let style = text::Style { border, view, ..text::Style::default() };
        text::frame(Ground::of(&trace), 0, &trace.start.state, &style).unwrap()
    };
    let frames = [
        draw(Border::None, None),
        draw(Border::Thin, None),
        draw(Border::Full, None),
        draw(Border::Thin, Some(1)),
    ];
    insta::assert_snapshot!(frames.join("\n\n"));
}

#[test]
fn a_small_map_as_svg() {
    let trace = still(&["..#", "..."], &[([0, 0], [1, 2]), ([1, 0], [0, 1])]);
    insta::assert_snapshot!(svg::draw(&trace, &Style::default()).unwrap());
}

#[test]
fn a_small_episode_as_svg() {
    let trace = played("{size: 4, num_agents: 2, seed: 1, obs_radius: 1, density: 0.2}");
    insta::assert_snapshot!("plain", svg::draw(&trace, &Style::default()).unwrap());
    let style = Style { egocentric: Some(1), border: Border::None, show_lines: false, ..Style::default() };
    insta::assert_snapshot!("egocentric", svg::draw(&trace, &style).unwrap());
}
