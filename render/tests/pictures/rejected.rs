//! Errors for invalid requests are one line.

use std::path::Path;

use pogema_core::{Cell, Error, Trace};
use pogema_render::{Color, Colors, Style, gif, html, raster, svg, video};

use crate::{played, still};

fn rejected(trace: &Trace, style: Style) -> String {
    let error = svg::draw(trace, &style).unwrap_err();
    assert_eq!(raster::png(trace, &style, 100).unwrap_err(), error);
    error.to_string()
}

#[test]
fn invalid_agents_frames_times_and_colors_are_rejected() {
    let trace = still(&[".."], &[([0, 0], [0, 1])]);
    let usual = Style::default;
    assert_eq!(rejected(&trace, Style { egocentric: Some(1), ..usual() }), "agent is `1`, expected 0 to 0");
    assert_eq!(rejected(&trace, Style { static_frame: Some(1), ..usual() }), "frame is `1`, expected 0 to 0");
    for step_time in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let text = rejected(&trace, Style { step_time, ..usual() });
        assert_eq!(
            text,
            format!("time of a step is `{step_time}`, expected a finite number of seconds greater than 0")
        );
    }
    let colors = Colors { agents: Vec::new(), ..Colors::default() };
    let text = rejected(&trace, Style { colors, ..usual() });
    assert_eq!(text, "number of agents' colours is `0`, expected at least 1");
}

#[test]
fn invalid_parts_of_an_episode_are_rejected() {
    let trace = played("{size: 5, num_agents: 2, seed: 1, max_episode_steps: 3, on_target: nothing}");
    let rejected = |first: usize, last: usize| trace.part(first..=last).unwrap_err().to_string();
    assert_eq!(
        rejected(2, 1),
        "range of frames is `2..1`, expected a first frame that is not after the last"
    );
    let num_steps = trace.steps.len();
    assert_eq!(
        rejected(0, num_steps + 1),
        format!("frame is `{}`, expected 0 to {num_steps}", num_steps + 1)
    );
}

#[test]
fn agents_off_the_map_and_lists_of_wrong_length_are_rejected() {
    let trace = still(&[".."], &[([0, 5], [0, 1])]);
    let text = rejected(&trace, Style::default());
    assert_eq!(text, "a cell of frame 0 is `(0, 5)`, expected a cell of the map of 1 row and 2 columns");
    let mut trace = still(&[".."], &[([0, 0], [0, 1])]);
    trace.start.state.active.clear();
    assert_eq!(rejected(&trace, Style::default()), "active has length 0, expected 1");
}

#[test]
fn lists_of_wrong_length_and_jumps_are_rejected_by_every_picture() {
    let whole =
        played("{size: 5, num_agents: 2, seed: 1, density: 0, max_episode_steps: 3, on_target: nothing}");
    let rejected_by_page = |trace: &Trace| {
        let error = html::replay(trace, "t").unwrap_err();
        let gif = gif::encode(trace, &Style::default(), 100, &mut |_, _| ()).unwrap_err();
        assert_eq!((rejected(trace, Style::default()), &gif), (error.to_string(), &error));
        error.to_string()
    };
    let mut trace = whole.clone();
    trace.steps[1].rewards.pop();
    assert_eq!(rejected_by_page(&trace), "rewards has length 1, expected 2");
    let mut trace = whole.clone();
    trace.steps[1].actions.pop();
    assert_eq!(rejected_by_page(&trace), "actions has length 1, expected 2");
    let mut trace = whole;
    trace.steps[0].state.cells[1] = Cell::new(0, 0);
    trace.steps[1].state.cells[1] = Cell::new(4, 4);
    trace.start.state.cells[1] = Cell::new(0, 0);
    let expected = "trace: line 4: agent 1 is on (4, 4), expected (0, 0) or a cell next to it";
    assert_eq!(rejected_by_page(&trace), expected);
}

#[test]
fn pictures_with_no_or_too_many_pixels_are_rejected() {
    let trace = still(&[".."], &[([0, 0], [0, 1])]);
    let draw = |width| raster::png(&trace, &Style::default(), width).unwrap_err().to_string();
    assert_eq!(
        draw(0),
        "size of the picture is `0 x 0 pixels`, expected 1 to 67108864 pixels in all: choose another width"
    );
    assert_eq!(
        draw(50_000),
        "size of the picture is `50000 x 40000 pixels`, expected 1 to 67108864 pixels in all: choose another width"
    );
    assert!(draw(u32::MAX).starts_with("size of the picture is `4294967295 x "));
    let moving =
        |style: &Style, width| gif::encode(&trace, style, width, &mut |_, _| ()).unwrap_err().to_string();
    assert_eq!(
        moving(&Style::default(), 4000),
        "size of the picture is `4000 x 3200 pixels`, expected 1 to 8388608 pixels in all: choose another width"
    );
    assert_eq!(
        moving(&Style { step_time: 1e6, ..Style::default() }, 100),
        "number of frames is `40000000`, expected at most 20000: draw fewer steps or more steps a second"
    );
    assert_eq!(
        moving(&Style { step_time: 0.019, ..Style::default() }, 100),
        "time of a step is `0.019`, expected at least 0.02 seconds in a GIF"
    );
}

#[test]
fn unknown_video_formats_are_rejected() {
    let trace = still(&[".."], &[([0, 0], [0, 1])]);
    for name in ["a.avi", "a", "mp4"] {
        let error =
            video::write(&trace, &Style::default(), 100, Path::new(name), &mut |_, _| ()).unwrap_err();
        assert_eq!(
            error,
            Error::io(name, "unknown video format, expected a name ending in `.mp4` or `.webm`")
        );
    }
}

#[test]
fn invalid_colors_are_rejected() {
    for text in ["", "red", "#12345", "#1234567", "#+12345", "#gggggg", "#€€"] {
        let error = text.parse::<Color>().unwrap_err().to_string();
        assert_eq!(error, format!("colour is `{text}`, expected a colour such as `#c1433c`"));
    }
    let color: Color = "#c1433C".parse().unwrap();
    assert_eq!((color, color.to_string().as_str()), (Color([0xc1, 0x43, 0x3c]), "#c1433c"));
}
