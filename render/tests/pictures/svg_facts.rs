//! An SVG shows the states of its episode at every frame.

use std::collections::BTreeSet;

use pogema_core::{Cell, OnGoal, Snapshot, Trace};
use pogema_render::{Border, Colors, Ground, Style, svg};
use roxmltree::Document;

use crate::common::{Policy, config, trace};
use crate::drawn::{Circle, attribute, elements, ids, squares};
use crate::{played, still};

/// Tolerance for rounded numbers in a drawing: coordinates in cells, and opacities.
const NEAR: f64 = 0.02;

fn episodes() -> Vec<Trace> {
    let mut traces = Vec::new();
    for on_target in ["finish", "nothing", "restart"] {
        for collision in ["priority", "soft"] {
            for (seed, policy) in [(1, Policy::AStar), (2, Policy::Random), (3, Policy::AStar)] {
                let text = format!(
                    "size: {}\nnum_agents: 9\nmax_episode_steps: {}\non_target: {on_target}\ncollision_system: {collision}\nseed: {seed}\nobs_radius: 3\n",
                    7 + seed,
                    20 * seed
                );
                traces.push(trace(&config(&text), policy));
            }
        }
    }
    // The shortest episode with a step.
    traces.push(traces[0].part(0..=1).unwrap());
    traces
}

/// Returns the time of a frame as a fraction of the duration.
fn time_of(frame: usize, num_frames: usize) -> f64 {
    (frame + 1) as f64 / (num_frames + 1) as f64
}

fn assert_follows(circle: &Circle, states: &[&Snapshot], cell: impl Fn(&Snapshot) -> Cell, agent: usize) {
    for (frame, state) in states.iter().enumerate() {
        let time = time_of(frame, states.len());
        let Cell { row, col } = cell(state);
        let [at_row, at_col] = circle.cell_at(time);
        let is_near = (at_row - f64::from(row)).abs() < NEAR && (at_col - f64::from(col)).abs() < NEAR;
        assert!(is_near, "agent {agent} frame {frame}: ({at_row}, {at_col}), expected ({row}, {col})");
        // Slightly later, because times are rounded.
        assert_eq!(circle.is_visible_at(time + 1e-3), state.active[agent], "agent {agent} frame {frame}");
    }
}

#[test]
fn agents_and_goals_follow_the_states() {
    for trace in episodes() {
        let text = svg::draw(&trace, &Style::default()).unwrap();
        let document = Document::parse(&text).unwrap();
        let states: Vec<_> = trace.states().collect();
        for (class, prefix) in [("agents", 'a'), ("goals", 'g')] {
            let circles = elements(&document, class, "circle");
            let taking_part = (0..9).filter(|&agent| states.iter().any(|state| state.active[agent]));
            let expected: Vec<_> = taking_part.map(|agent| format!("{prefix}{agent}")).collect();
            let found: Vec<_> = circles.iter().map(|node| node.attribute("id").unwrap()).collect();
            assert_eq!(found, expected);
            for node in circles {
                let agent: usize = node.attribute("id").unwrap()[1..].parse().unwrap();
                let circle = Circle::of(node);
                assert_eq!(circle.color, Colors::default().agents[agent].to_string());
                let cells = |state: &Snapshot| {
                    if class == "agents" { state.cells[agent] } else { state.goals[agent] }
                };
                assert_follows(&circle, &states, cells, agent);
            }
        }
    }
}

#[test]
fn an_svg_has_no_scripts_and_no_external_references() {
    let known = ["svg", "g", "path", "circle", "rect", "animate", "animateMotion"];
    for trace in episodes() {
        let text = svg::draw(&trace, &Style::default()).unwrap();
        let document = roxmltree::Document::parse(&text).unwrap();
        for element in document.descendants().filter(roxmltree::Node::is_element) {
            let name = element.tag_name().name();
            assert!(known.contains(&name), "{name}");
            let mut names = element.attributes().map(|attribute| attribute.name());
            assert!(!names.any(|name| name.starts_with("on") || name == "href" || name == "style"), "{name}");
        }
    }
}

#[test]
fn every_animation_repeats_forever_with_the_same_duration() {
    for trace in episodes() {
        let text = svg::draw(&trace, &Style { egocentric: Some(0), ..Style::default() }).unwrap();
        let document = Document::parse(&text).unwrap();
        let is_animated = |node: &roxmltree::Node<'_, '_>| node.tag_name().name().starts_with("animate");
        let all: BTreeSet<_> = document
            .descendants()
            .filter(is_animated)
            .map(|node| (node.attribute("dur"), node.attribute("repeatCount")))
            .collect();
        let duration = (states_of(&trace, 0).len() as f64 * 0.25).to_string();
        let duration = format!("{}s", duration.trim_start_matches('0'));
        assert_eq!(all, BTreeSet::from([(Some(duration.as_str()), Some("indefinite"))]));
    }
}

#[test]
fn obstacles_are_those_of_the_map_and_its_border() {
    for trace in episodes() {
        for border in [Border::None, Border::Thin, Border::Full] {
            let text = svg::draw(&trace, &Style { border, ..Style::default() }).unwrap();
            let document = Document::parse(&text).unwrap();
            let shift = 0.2;
            let found: BTreeSet<_> = elements(&document, "obstacles", "path")
                .iter()
                .flat_map(|path| squares(path.attribute("d").unwrap()))
                .map(|at| at.map(|middle| (middle - shift).round() as i32))
                .collect();
            let ground = Ground::of(&trace);
            let all = ground.rows(border).flat_map(|row| ground.cols(border).map(move |col| [row, col]));
            let expected: BTreeSet<_> = all.filter(|&[row, col]| ground.is_obstacle(row, col)).collect();
            assert_eq!(found, expected);
            let (height, width) = (trace.header.map.height() as i32, trace.header.map.width() as i32);
            let ring = usize::from(border != Border::None) * (2 * (height + width) + 4) as usize;
            assert_eq!(found.len(), trace.header.map.obstacles().iter().filter(|&&it| it).count() + ring);
            let view_box: Vec<i32> = document
                .root_element()
                .attribute("viewBox")
                .unwrap()
                .split(' ')
                .map(|it| it.parse().unwrap())
                .collect();
            let is_inside = |&[row, col]: &[i32; 2]| {
                (view_box[0] + 1..view_box[0] + view_box[2]).contains(&col)
                    && (view_box[1] + 1..view_box[1] + view_box[3]).contains(&row)
            };
            assert!(found.iter().all(is_inside));
        }
    }
}

/// Returns the states that the view of an agent shows.
fn states_of(trace: &Trace, own: usize) -> Vec<&Snapshot> {
    let mut states: Vec<_> = trace.states().collect();
    if trace.header.config.on_goal == OnGoal::Finish
        && let Some(end) = states.iter().position(|state| !state.active[own])
    {
        states.truncate(end + 1);
    }
    states
}

#[test]
fn a_view_shades_agents_that_its_agent_does_not_see() {
    for (trace, own) in episodes().iter().flat_map(|trace| [(trace, 0), (trace, 5)]) {
        let text = svg::draw(trace, &Style { egocentric: Some(own), ..Style::default() }).unwrap();
        let document = Document::parse(&text).unwrap();
        let states = states_of(trace, own);
        for node in elements(&document, "agents", "circle") {
            let agent: usize = node.attribute("id").unwrap()[1..].parse().unwrap();
            let circle = Circle::of(node);
            assert_eq!(circle.color, if agent == own { "#c1433c" } else { "#6e81af" });
            assert_follows(&circle, &states, |state| state.cells[agent], agent);
            for (frame, state) in states.iter().enumerate() {
                let Cell { row, col } = state.cells[agent];
                let is_seen = Ground::of(trace).sees(state.cells[own], row.into(), col.into());
                let found = circle.opacity_at(time_of(frame, states.len()));
                let expected = if is_seen { 1.0 } else { 0.2 };
                assert!((found - expected).abs() < NEAR, "agent {agent} frame {frame}");
            }
        }
        let goals = elements(&document, "goals", "circle");
        let goals: Vec<_> = goals.iter().map(|node| node.attribute("id").unwrap()).collect();
        assert_eq!(goals, [format!("g{own}")]);
    }
}

#[test]
fn a_view_shades_obstacles_until_its_agent_sees_them() {
    for (trace, own) in episodes().iter().flat_map(|trace| [(trace, 0), (trace, 5)]) {
        let text = svg::draw(trace, &Style { egocentric: Some(own), ..Style::default() }).unwrap();
        let document = Document::parse(&text).unwrap();
        let states = states_of(trace, own);
        for path in elements(&document, "obstacles", "path") {
            let fade = path.children().find(|child| child.has_tag_name("animate"));
            let shown_from = fade.map(|node| {
                let times = node.attribute("keyTimes").unwrap().split(';').rev().nth(1).unwrap();
                (times.parse::<f64>().unwrap() * (states.len() + 1) as f64).round() as usize - 1
            });
            let is_shaded = path.attribute("opacity") == Some(".2");
            for at in squares(path.attribute("d").unwrap()) {
                let [row, col] = at.map(|middle| (middle - 0.2).round() as i32);
                let first =
                    states.iter().position(|state| Ground::of(trace).sees(state.cells[own], row, col));
                assert_eq!(shown_from.or((!is_shaded).then_some(0)), first, "({row}, {col})");
            }
        }
    }
}

#[test]
fn a_static_frame_shows_its_state() {
    for trace in episodes() {
        let frame = trace.steps.len() / 2;
        let style = Style { static_frame: Some(frame), ..Style::default() };
        let text = svg::draw(&trace, &style).unwrap();
        assert!(!text.contains("<animate"));
        let document = Document::parse(&text).unwrap();
        let state = trace.state(frame).unwrap();
        let found: Vec<_> = elements(&document, "agents", "circle")
            .iter()
            .map(|node| [attribute(*node, "cy") as u16, attribute(*node, "cx") as u16])
            .collect();
        let active = state.cells.iter().zip(&state.active).filter(|(_, active)| **active);
        let expected: Vec<[u16; 2]> = active.map(|(cell, _)| (*cell).into()).collect();
        assert_eq!(found, expected);
    }
}

#[test]
fn a_static_frame_of_a_view_shows_all_obstacles_seen_so_far() {
    for trace in episodes() {
        let frame = trace.steps.len() / 2;
        let style = Style { static_frame: Some(frame), egocentric: Some(2), ..Style::default() };
        let text = svg::draw(&trace, &style).unwrap();
        let document = Document::parse(&text).unwrap();
        for path in elements(&document, "obstacles", "path") {
            for at in squares(path.attribute("d").unwrap()) {
                let [row, col] = at.map(|middle| (middle - 0.2).round() as i32);
                let sees = |state: &Snapshot| Ground::of(&trace).sees(state.cells[2], row, col);
                let is_seen = trace.states().take(frame + 1).any(sees);
                assert_eq!(path.attribute("opacity"), (!is_seen).then_some(".2"), "({row}, {col})");
            }
        }
    }
}

#[test]
fn agents_keep_their_colors_after_others_have_finished() {
    let mut trace = still(&["..."], &[([0, 0], [0, 1]), ([0, 1], [0, 2]), ([0, 2], [0, 0])]);
    trace.start.state.active[0] = false;
    let text = svg::draw(&trace, &Style::default()).unwrap();
    let document = Document::parse(&text).unwrap();
    let colors: Vec<_> =
        elements(&document, "agents", "circle").into_iter().map(|node| Circle::of(node).color).collect();
    assert_eq!(colors, ["#2e6f9e", "#6e81af"]);
}

#[test]
fn the_style_selects_agents_lines_and_colors() {
    let trace = played("{size: 6, num_agents: 3, seed: 1}");
    let none =
        svg::draw(&trace, &Style { show_agents: false, egocentric: Some(1), ..Style::default() }).unwrap();
    assert!(ids(&Document::parse(&none).unwrap()).is_empty());
    assert!(!none.contains("window"));
    let plain = svg::draw(&trace, &Style { show_lines: false, ..Style::default() }).unwrap();
    assert!(!plain.contains("lines") && svg::draw(&trace, &Style::default()).unwrap().contains("lines"));
    let agents = vec!["#ff0000".parse().unwrap(), "#00ff00".parse().unwrap()];
    let style = Style { colors: Colors { agents, ..Colors::default() }, ..Style::default() };
    let text = svg::draw(&trace, &style).unwrap();
    let document = Document::parse(&text).unwrap();
    let colors: Vec<_> =
        elements(&document, "goals", "circle").into_iter().map(|node| Circle::of(node).color).collect();
    assert_eq!(colors, ["#ff0000", "#00ff00", "#ff0000"]);
}

#[test]
fn a_part_of_an_episode_has_its_states() {
    let trace = played("{size: 8, num_agents: 4, seed: 3, on_target: restart, max_episode_steps: 30}");
    let part = trace.part(10..=20).unwrap();
    let whole: Vec<_> = trace.states().collect();
    assert_eq!(part.states().collect::<Vec<_>>(), whole[10..=20]);
    assert_eq!(trace.part(7..=7).unwrap().states().collect::<Vec<_>>(), [whole[7]]);
}
