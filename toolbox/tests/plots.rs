//! Properties of drawn plots: sizes for a two-column paper, complete and legible texts, and lines that differ in grey.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::BTreeSet;

use pogema_toolbox::views::{ImageFormat, View};
use pogema_toolbox::{Node, Results, Row};

/// The default width and height of a plot: one column of a paper. Units: points.
const COLUMN: (f64, f64) = (244.8, 187.2);

const ALGORITHMS: [&str; 8] =
    ["DCC", "IQL", "LaCAM", "MAMBA", "QMIX", "QPLEX", "SCRIMP", "A long name of a policy"];

/// Returns rows of eight algorithms in all sets of the paper.
fn results() -> Results {
    let sets = ["01-random", "02-mazes", "03-warehouse", "04-movingai", "05-puzzles", "06-pathfinding"];
    let mut rows = Vec::new();
    for (at, algorithm) in ALGORITHMS.into_iter().enumerate() {
        for set in sets {
            for (number, agents) in [8, 16, 24, 32, 48, 64].into_iter().enumerate() {
                let cost = agents * (15 + 12 * at) + 3 * number;
                let text = format!(
                    r#"{{"metrics": {{"CSR": 1, "SoC": {cost}, "makespan": {cost}, "ep_length": {cost}, "runtime": {}}},
                        "env_grid_search": {{"num_agents": {agents}, "map_name": "{set}"}}, "algorithm": "{algorithm}"}}"#,
                    0.01 * cost as f64,
                );
                let row: Row = serde_json::from_str(&text).unwrap();
                rows.push(Row { set: set.to_owned(), ..row });
            }
        }
    }
    Results { rows, notes: Vec::new() }
}

fn drawn(fields: &str, kind: ImageFormat) -> Vec<u8> {
    let view = View::read("View1", &Node::parse(fields).unwrap()).unwrap();
    view.show("View1", &results(), None).unwrap().pictures[0].bytes(kind).unwrap()
}

fn svg(fields: &str) -> String {
    String::from_utf8(drawn(fields, ImageFormat::Svg)).unwrap()
}

/// A text, the left, upper, right and lower end of its box, and whether it is rotated.
type Label = (String, [f64; 4], bool);

/// Returns the texts of a panel; if the page has no such panel, those of the page itself.
fn labels(page: &roxmltree::Document<'_>, panel: usize) -> Vec<Label> {
    let groups = page.root_element().children().filter(|node| node.has_tag_name("g"));
    let panels: Vec<_> =
        groups.filter(|group| group.children().any(|node| node.has_tag_name("text"))).collect();
    let parent = panels.get(panel).copied().unwrap_or(page.root_element());
    let texts = parent.children().filter(|node| node.has_tag_name("text"));
    texts
        .map(|node| {
            let number = |name| node.attribute(name).unwrap().parse::<f64>().unwrap();
            let (x, y, size) = (number("x"), number("y"), number("font-size"));
            let text = node.text().unwrap().to_owned();
            // Digits of DejaVu Sans are 0.64 of the font size wide; most other characters are narrower.
            let width = text.chars().count() as f64 * size * 0.62;
            let left = match node.attribute("text-anchor") {
                Some("middle") => x - width / 2.0,
                Some("end") => x - width,
                _ => x,
            };
            (text, [left, y - 0.75 * size, left + width, y], node.has_attribute("transform"))
        })
        .collect()
}

fn assert_apart(labels: &[Label]) {
    let level: Vec<&Label> = labels.iter().filter(|(_, _, is_rotated)| !is_rotated).collect();
    for (at, (one, a, _)) in level.iter().enumerate() {
        for (other, b, _) in &level[at + 1..] {
            let is_apart = a[2] <= b[0] || b[2] <= a[0] || a[3] <= b[1] || b[3] <= a[1];
            assert!(is_apart, "`{one}` {a:?} covers `{other}` {b:?}");
        }
    }
}

#[test]
fn plots_of_all_types_fill_a_column_and_have_legible_texts() {
    for fields in [
        "{type: plot, x: num_agents, y: SoC, name: Random}",
        "{type: plot, x: num_agents, y: SoC, use_log_scale_x: True, use_log_scale_y: True}",
        "{type: plot, x: num_agents, y: SoC, legend_loc: upper left}",
        "{type: plot, x: map_name, y: SoC}",
        "{type: box, y: SoC}",
        "{type: cactus}",
        "{type: compare, first: DCC, second: IQL}",
        "{type: radar}",
    ] {
        let text = svg(fields);
        let page = roxmltree::Document::parse(&text).unwrap();
        let root = page.root_element();
        assert_eq!(root.attribute("width"), Some(format!("{}pt", COLUMN.0).as_str()), "{fields}");
        assert_eq!(root.attribute("height"), Some(format!("{}pt", COLUMN.1).as_str()), "{fields}");
        assert_eq!(root.attribute("viewBox"), Some(format!("0 0 {} {}", COLUMN.0, COLUMN.1).as_str()));
        for node in page.descendants().filter(|node| node.has_tag_name("text")) {
            let size: f64 = node.attribute("font-size").unwrap().parse().unwrap();
            assert!((7.0..=9.0).contains(&size), "{fields}: {size}");
        }
        assert_apart(&labels(&page, 0));
    }
}

#[test]
fn panels_have_titles_and_all_tick_labels() {
    let text = svg("{type: multi-plot, x: num_agents, y: SoC, over: map_name}");
    let page = roxmltree::Document::parse(&text).unwrap();
    for (panel, title) in ["01-random", "02-mazes", "03-warehouse", "04-movingai"].into_iter().enumerate() {
        let labels = labels(&page, panel);
        for text in [title, "8", "16", "24", "32", "48", "64"] {
            assert!(
                labels.iter().any(|(label, ..)| label == text),
                "no `{text}` in panel {panel}: {labels:?}"
            );
        }
        assert_apart(&labels);
    }
    // A title that is a number also names its field.
    let text = svg("{type: multi-plot, x: map_name, y: SoC, over: num_agents}");
    assert!(text.contains(">Number of Agents: 8<"), "{text}");
    let text =
        svg("{type: multi-plot, x: num_agents, y: SoC, over: map_name, remove_individual_titles: True}");
    assert!(!text.contains(">01-random<"), "{text}");
}

#[test]
fn labels_without_room_are_slanted_and_complete() {
    let text = svg("{type: plot, x: map_name, y: SoC, width: 2}");
    let page = roxmltree::Document::parse(&text).unwrap();
    let labels = labels(&page, 0);
    for name in ["01-random", "02-mazes", "03-warehouse", "04-movingai", "05-puzzles", "06-pathfinding"] {
        assert!(labels.iter().any(|(label, _, is_rotated)| label == name && *is_rotated), "{labels:?}");
    }
}

#[test]
fn numbers_without_room_have_no_label() {
    let text = svg("{type: plot, x: num_agents, y: SoC, ticks: [8, 12, 16, 24, 32, 160, 192, 960]}");
    let page = roxmltree::Document::parse(&text).unwrap();
    let labels = labels(&page, 0);
    assert_apart(&labels);
    for shown in ["8", "192", "960"] {
        assert!(labels.iter().any(|(label, _, is_rotated)| label == shown && !is_rotated), "{labels:?}");
    }
    assert!(!labels.iter().any(|(label, ..)| label == "12"), "{labels:?}");
    // All ticks keep their grid lines.
    let grid_lines = page.descendants().filter(|node| {
        node.attribute("stroke") == Some("#dddddd") && node.attribute("x1") == node.attribute("x2")
    });
    assert_eq!(grid_lines.count(), 8);
}

#[test]
fn logarithmic_axes_have_decimal_ticks() {
    let text = svg("{type: plot, x: num_agents, y: SoC, use_log_scale_x: True, use_log_scale_y: True}");
    for power in ["128", "256", "512", "1024", "1,024", "2048"] {
        assert!(!text.contains(&format!(">{power}<")), "{power}: {text}");
    }
    // The horizontal axis has ticks at the values of the data.
    assert!(text.contains(">1,000<") && text.contains(">48<"), "{text}");
}

/// The colour, dash pattern and marker of a line.
type Sign<'a> = (&'a str, &'a str, BTreeSet<String>);

/// Returns a part of a marker, without its place and colour.
fn part(node: roxmltree::Node<'_, '_>) -> String {
    let numbers: Vec<f64> = match node.tag_name().name() {
        "line" => {
            ["x1", "y1", "x2", "y2"].map(|name| node.attribute(name).unwrap().parse().unwrap()).to_vec()
        }
        "path" => {
            let words = node.attribute("d").unwrap().split(|letter: char| ", MLZ".contains(letter));
            words.filter(|word| !word.is_empty()).map(|word| word.parse().unwrap()).collect()
        }
        name => return name.to_owned(),
    };
    let (points, _) = numbers.as_chunks::<2>();
    let [left, top] = points[0];
    let offsets: Vec<_> =
        points.iter().map(|[x, y]| [(x - left).round() as i64, (y - top).round() as i64]).collect();
    format!("{offsets:?}")
}

/// Returns the signs of all lines of a plot and of its legend. The parts of the markers follow their line.
fn signs<'a>(page: &'a roxmltree::Document<'_>) -> Vec<Sign<'a>> {
    let mut signs: Vec<Sign<'_>> = Vec::new();
    for node in page.descendants() {
        let [colour, fill] = ["stroke", "fill"].map(|name| node.attribute(name).unwrap_or_default());
        if node.attribute("stroke-width") == Some("1.5") && fill == "none" {
            signs.push((colour, node.attribute("stroke-dasharray").unwrap_or_default(), BTreeSet::new()));
        } else if let Some((of_line, _, marker)) = signs.last_mut()
            && !node.has_tag_name("text")
            && [colour, fill].contains(of_line)
        {
            marker.insert(part(node));
        }
    }
    signs
}

#[test]
fn lines_differ_in_dashes_and_markers() {
    for fields in ["{type: plot, x: num_agents, y: SoC}", "{type: cactus}", "{type: radar}"] {
        let text = svg(fields);
        let page = roxmltree::Document::parse(&text).unwrap();
        let signs = signs(&page);
        let different: BTreeSet<_> = signs.iter().collect();
        assert_eq!(
            (signs.len(), different.len()),
            (2 * ALGORITHMS.len(), ALGORITHMS.len()),
            "{fields}: {signs:?}"
        );
        let without_colours: BTreeSet<_> = signs.iter().map(|(_, dashes, marker)| (dashes, marker)).collect();
        assert_eq!(without_colours.len(), ALGORITHMS.len(), "{fields}: {signs:?}");
        let markers: BTreeSet<_> = signs.iter().map(|(.., marker)| marker).collect();
        assert_eq!(markers.len(), ALGORITHMS.len(), "{fields}: {signs:?}");
    }
}

#[test]
fn a_png_has_the_requested_resolution() {
    let bytes = drawn("{type: plot, x: num_agents, y: SoC, figure_dpi: 150}", ImageFormat::Png);
    let info = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap().info().clone();
    assert_eq!((info.width, info.height), (510, 390));
    // 150 dots per inch.
    assert_eq!(info.pixel_dims.unwrap().xppu, 5906);
    assert!(drawn("{type: radar}", ImageFormat::Pdf).starts_with(b"%PDF"));
}
