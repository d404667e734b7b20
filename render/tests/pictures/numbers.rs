//! Colours and numbers, which match agents and their goals.

use std::collections::HashSet;

use pogema_render::{Colors, Style, raster, svg};
use roxmltree::Document;

use crate::played;

#[test]
fn agents_and_goals_have_the_number_of_the_agent_if_the_style_says_so() {
    let trace = played("{size: 8, num_agents: 12, seed: 1}");
    let style = Style { show_numbers: true, ..Style::default() };
    let text = svg::draw(&trace, &style).unwrap();
    let document = Document::parse(&text).unwrap();
    for group in ["agents", "goals"] {
        let group = document.descendants().find(|node| node.attribute("class") == Some(group)).unwrap();
        let numbers: Vec<_> = group.children().filter(|node| node.has_tag_name("text")).collect();
        let circles: Vec<_> = group.children().filter(|node| node.has_tag_name("circle")).collect();
        assert_eq!(numbers.len(), 12);
        for (number, circle) in numbers.iter().zip(&circles) {
            assert_eq!(number.text(), circle.attribute("id").map(|id| &id[1..]));
            assert_eq!(number.attribute("x"), circle.attribute("cx"));
            let motion =
                |node: &roxmltree::Node<'_, '_>| node.children().filter(roxmltree::Node::is_element).count();
            assert_eq!(motion(number), motion(circle), "a number moves with its circle");
        }
    }
    assert!(!svg::draw(&trace, &Style::default()).unwrap().contains("<text"));
    let [plain, numbered] = [false, true]
        .map(|show_numbers| raster::png(&trace, &Style { show_numbers, ..Style::default() }, 400).unwrap());
    assert_ne!(plain, numbered);
}

#[test]
fn goals_are_drawn_before_agents() {
    let text = svg::draw(&played("{size: 6, num_agents: 3, seed: 1}"), &Style::default()).unwrap();
    let [lines, goals, agents] =
        ["lines", "goals", "agents"].map(|class| text.find(&format!("class=\"{class}\"")));
    assert!(lines < goals && goals < agents);
}

#[test]
fn agents_have_the_colors_of_the_replay_page() {
    let colors = Colors::default().agents;
    assert_eq!(colors.iter().collect::<HashSet<_>>().len(), 24);
    let script = include_str!("../../src/html/shared/paint.js");
    let palette = script.split_once("const PALETTE = [").unwrap().1.split_once(']').unwrap().0;
    let named: Vec<_> = palette.split('"').filter(|part| part.starts_with('#')).collect();
    assert_eq!(named, colors.iter().map(ToString::to_string).collect::<Vec<_>>());
    let luma = "0.299 * red + 0.587 * green + 0.114 * blue";
    for source in [script, include_str!("../../src/numbers.rs")] {
        assert!(source.contains(luma), "numbers have the same ink");
    }
}
