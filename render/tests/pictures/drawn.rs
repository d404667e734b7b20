//! A reader of SVG drawings, independent of the writer.

use std::collections::BTreeSet;

use roxmltree::{Document, Node};

/// One circle of a drawing, with its animations.
pub struct Circle {
    pub color: String,
    cell: [f64; 2],
    opacity: f64,
    is_visible: bool,
    motion: Option<Motion>,
    opacities: Option<(Vec<f64>, Vec<f64>)>,
    visible: Option<(Vec<bool>, Vec<f64>)>,
}

struct Motion {
    points: Vec<[f64; 2]>,
    key_points: Vec<f64>,
    key_times: Vec<f64>,
}

/// Returns all elements with the given tag inside the group with the given class.
pub fn elements<'a>(document: &'a Document<'_>, class: &str, tag: &str) -> Vec<Node<'a, 'a>> {
    let is_class = |node: &Node<'_, '_>| node.attribute("class") == Some(class);
    let group = document.descendants().find(is_class).unwrap();
    group.descendants().filter(|node| node.has_tag_name(tag)).collect()
}

pub fn attribute(node: Node<'_, '_>, name: &str) -> f64 {
    node.attribute(name).unwrap().parse().unwrap()
}

fn list(text: &str) -> Vec<f64> {
    text.split(';').map(|number| number.parse().unwrap()).collect()
}

fn keys(node: Node<'_, '_>, name: &str) -> Vec<f64> {
    list(node.attribute(name).unwrap())
}

impl Circle {
    pub fn of(node: Node<'_, '_>) -> Self {
        let animated =
            |name: &str| node.children().find(|child| child.attribute("attributeName") == Some(name));
        let motion = node.children().find(|child| child.has_tag_name("animateMotion"));
        let words = |node: Node<'_, '_>| {
            node.attribute("values").unwrap().split(';').map(|word| word == "visible").collect::<Vec<_>>()
        };
        Self {
            color: node.attribute("fill").or(node.attribute("stroke")).unwrap().to_owned(),
            cell: [attribute(node, "cy"), attribute(node, "cx")],
            opacity: node.attribute("opacity").map_or(1.0, |text| text.parse().unwrap()),
            is_visible: node.attribute("visibility") != Some("hidden"),
            motion: motion.map(Motion::of),
            opacities: animated("opacity").map(|node| (keys(node, "values"), keys(node, "keyTimes"))),
            visible: animated("visibility").map(|node| (words(node), keys(node, "keyTimes"))),
        }
    }

    /// Returns (row, col) at a fraction of the duration.
    pub fn cell_at(&self, time: f64) -> [f64; 2] {
        let Some(motion) = &self.motion else { return self.cell };
        let [down, right] = motion.at(between(&motion.key_points, &motion.key_times, time));
        [self.cell[0] + down, self.cell[1] + right]
    }

    pub fn opacity_at(&self, time: f64) -> f64 {
        self.opacities.as_ref().map_or(self.opacity, |(values, times)| between(values, times, time))
    }

    pub fn is_visible_at(&self, time: f64) -> bool {
        let Some((values, times)) = &self.visible else { return self.is_visible };
        values[times.iter().rposition(|&from| from <= time).unwrap()]
    }
}

impl Motion {
    fn of(node: Node<'_, '_>) -> Self {
        assert_eq!(node.attribute("calcMode"), Some("linear"));
        Self {
            points: points(node.attribute("path").unwrap()),
            key_points: keys(node, "keyPoints"),
            key_times: keys(node, "keyTimes"),
        }
    }

    /// Returns the point at a fraction of the path's length.
    fn at(&self, share: f64) -> [f64; 2] {
        let length = |pair: &[[f64; 2]]| (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
        let mut left = share * self.points.windows(2).map(length).sum::<f64>();
        for pair in self.points.windows(2) {
            let long = length(pair);
            if left <= long {
                let part = left / long;
                return [0, 1].map(|axis| pair[0][axis] + part * (pair[1][axis] - pair[0][axis]));
            }
            left -= long;
        }
        *self.points.last().unwrap()
    }
}

/// Returns the corners of a path of straight segments, each as (row, col).
pub fn points(path: &str) -> Vec<[f64; 2]> {
    let mut points: Vec<[f64; 2]> = Vec::new();
    let begins: Vec<usize> =
        path.char_indices().filter(|(_, it)| it.is_alphabetic()).map(|(at, _)| at).collect();
    let ends = begins.iter().skip(1).copied().chain([path.len()]);
    for segment in begins.iter().zip(ends).map(|(&from, to)| &path[from..to]) {
        let [row, col] = points.last().copied().unwrap_or_default();
        let numbers: Vec<f64> =
            segment[1..].split_whitespace().map(|number| number.parse().unwrap()).collect();
        points.push(match (&segment[..1], &numbers[..]) {
            ("M", &[x, y]) => [y, x],
            ("h", &[right]) => [row, col + right],
            ("v", &[down]) => [row + down, col],
            ("l", &[right, down]) => [row + down, col + right],
            ("z", &[]) => continue,
            _ => unreachable!("{segment}"),
        });
    }
    points
}

/// Returns the centres of the closed squares of a path.
pub fn squares(path: &str) -> Vec<[f64; 2]> {
    let squares = path.split_inclusive('z').map(|square| {
        let corners = points(square);
        assert_eq!(corners.len(), 4, "{square}");
        [0, 1].map(|axis| corners.iter().map(|corner| corner[axis]).sum::<f64>() / 4.0)
    });
    squares.collect()
}

/// Returns the ids of all elements with an id.
pub fn ids(document: &Document<'_>) -> BTreeSet<String> {
    document.descendants().filter_map(|node| node.attribute("id")).map(str::to_owned).collect()
}

fn between(values: &[f64], times: &[f64], time: f64) -> f64 {
    assert_eq!(values.len(), times.len());
    assert_eq!((times[0], times[times.len() - 1]), (0.0, 1.0));
    assert!(times.is_sorted());
    let next = times.iter().position(|&at| at >= time).unwrap().max(1);
    let share = (time - times[next - 1]) / (times[next] - times[next - 1]);
    values[next - 1] + share * (values[next] - values[next - 1])
}
