//! Text frames show the state and fit the terminal.

use pogema_core::{Error, Trace};
use pogema_render::{Border, Ground, text};

use crate::{played, still};

fn frame(trace: &Trace, style: text::Style) -> String {
    text::frame(Ground::of(trace), 0, &trace.start.state, &style).unwrap()
}

#[test]
fn many_agents_are_numbers_and_their_goals_have_a_star() {
    let trace = played("{size: 12, num_agents: 40, seed: 2, density: 0.1}");
    let style = text::Style { border: Border::None, ..text::Style::default() };
    let text = frame(&trace, style);
    for (row, line) in text.lines().skip(1).enumerate() {
        assert_eq!(line.chars().count(), 12 * 4 - 1);
        let cells: Vec<String> =
            line.chars().collect::<Vec<_>>().chunks(4).map(|cell| cell.iter().collect()).collect();
        for (col, shown) in cells.iter().enumerate() {
            let here = |cells: &[pogema_core::Cell]| {
                cells.iter().position(|cell| usize::from(cell.row) == row && usize::from(cell.col) == col)
            };
            let expected = match (here(&trace.start.state.cells), here(&trace.start.state.goals)) {
                (Some(agent), _) => agent.to_string(),
                (None, Some(agent)) => format!("*{agent}"),
                _ if Ground::of(&trace).is_obstacle(row as i32, col as i32) => "███".into(),
                _ => "·".into(),
            };
            assert_eq!(shown.trim(), expected);
        }
    }
}

#[test]
fn colors_do_not_change_the_text() {
    let trace = played("{size: 8, num_agents: 4, seed: 2}");
    let plain = frame(&trace, text::Style::default());
    let colored = frame(&trace, text::Style { is_colored: true, ..text::Style::default() });
    assert_ne!(colored, plain);
    assert_eq!(console::strip_ansi_codes(&colored), plain);
}

#[test]
fn a_frame_is_never_larger_than_the_terminal() {
    for (size, num_agents) in [(3, 1), (20, 5), (64, 64)] {
        let trace = played(&format!("{{size: {size}, num_agents: {num_agents}, seed: 2, density: 0.2}}"));
        for rows in [1, 2, 3, 4, 10, 24, 100] {
            for cols in [1, 2, 5, 20, 79, 300] {
                for border in [Border::None, Border::Thin, Border::Full] {
                    for view in [None, Some(num_agents - 1)] {
                        let style =
                            text::Style { view, border, is_colored: true, max_size: Some((rows, cols)) };
                        let text = frame(&trace, style);
                        assert!(text.lines().count() <= rows, "{style:?}");
                        assert!(
                            text.lines().all(|line| console::measure_text_width(line) <= cols),
                            "{style:?}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn a_limit_of_rows_alone_keeps_all_columns() {
    let trace = played("{size: 20, num_agents: 5, seed: 2}");
    let style = text::Style { max_size: Some((10, usize::MAX)), ..text::Style::default() };
    let text = frame(&trace, style);
    assert!(text.contains(" of 20") && !text.contains("columns"), "{text}");
}

#[test]
fn a_cropped_map_names_its_part_and_shows_the_viewing_agent() {
    let trace = played("{size: 64, num_agents: 20, seed: 2}");
    for view in 0..20 {
        let style = text::Style { view: Some(view), max_size: Some((12, 40)), ..text::Style::default() };
        let text = frame(&trace, style);
        let (first, rest) = text.split_once('\n').unwrap();
        assert!(first.contains(" of 64") && first.contains("rows ") && first.contains("columns "), "{first}");
        let letter = pogema_core::picture::agent_letter(view);
        assert!(rest.contains(letter), "{letter}\n{text}");
        assert!(text.lines().count() == 12 && text.ends_with('┘'), "{text}");
    }
}

#[test]
fn a_view_shows_only_its_window_and_its_own_goal() {
    // The radius is 2: agent 0 sees agent 1 at the edge of its window, but not agent 2. A view hides all other goals.
    let trace = still(&[".......#", "........"], &[([0, 0], [1, 6]), ([0, 2], [1, 0]), ([0, 3], [1, 1])]);
    let style = text::Style { view: Some(0), border: Border::None, ..text::Style::default() };
    assert_eq!(frame(&trace, style), "step 0\na · b          \n· · ·       A  ");
}

#[test]
fn an_agent_hides_a_goal_and_a_lower_index_hides_a_higher_one() {
    let trace = still(&["...."], &[([0, 0], [0, 3]), ([0, 1], [0, 3]), ([0, 0], [0, 1])]);
    let style = text::Style { border: Border::None, ..text::Style::default() };
    assert_eq!(frame(&trace, style), "step 0\na b · A");
}

#[test]
fn invalid_requests_are_rejected_with_one_line() {
    let trace = still(&[".."], &[([0, 0], [0, 1])]);
    let rejected = |style: text::Style| {
        text::frame(Ground::of(&trace), 0, &trace.start.state, &style).unwrap_err().to_string()
    };
    assert_eq!(
        rejected(text::Style { view: Some(1), ..text::Style::default() }),
        "agent is `1`, expected 0 to 0"
    );
    let nothing = rejected(text::Style { max_size: Some((0, 5)), ..text::Style::default() });
    assert_eq!(nothing, "size of the terminal is `0`, expected at least one row and one column");
    let mut state = trace.start.state.clone();
    state.goals.clear();
    let error = text::frame(Ground::of(&trace), 0, &state, &text::Style::default()).unwrap_err();
    assert_eq!(error, Error::Length { what: "goals", want: 1, got: 0 });
}
