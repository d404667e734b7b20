//! Pictures and animations as SVG, in the style of POGEMA's.
//!
//! One unit is one cell, and the centre of the cell (0, 0) is the origin. Obstacles that are first seen at the same
//! frame share one path, and an agent moves along one path with one list of times, so files are much smaller than
//! POGEMA's.

mod timing;

use std::fmt::Write as _;

use pogema_core::{Error, Trace};

use crate::numbers::{self, FONT};
use crate::scene::{LINE_OPACITY, Look, Obstacles, SHADED, Scene, size};
use crate::style::{Color, Style};
use timing::{Timing, number};

/// The longer side of a picture unless the viewer sets another. Units: pixels.
const LONGER_SIDE: f64 = 512.0;
/// The white outline of a number, behind its digits. Units: cells.
const HALO: &str = " stroke=\"#fff\" stroke-width=\".1\" paint-order=\"stroke\"";

/// Draws an episode, or one frame of it.
///
/// Source: POGEMA 1.4.0, `svg_animation/animation_drawer.py`, `AnimationDrawer`
///
/// # Errors
/// Those of [`crate::check()`], and if the style names a missing agent or frame or is otherwise invalid.
pub fn draw(trace: &Trace, style: &Style) -> Result<String, Error> {
    let scene = Scene::new(trace, style)?;
    let timing =
        style.static_frame.is_none().then(|| Timing::new(scene.states.len(), style.step_time)).flatten();
    let mut picture = Picture { scene: &scene, timing, text: String::new() };
    picture.open();
    if style.show_lines {
        picture.lines();
    }
    picture.obstacles();
    picture.goals();
    picture.agents();
    picture.window();
    picture.text.push_str("</svg>\n");
    Ok(picture.text)
}

struct Picture<'a> {
    scene: &'a Scene<'a>,
    /// None for a still picture.
    timing: Option<Timing>,
    text: String,
}

impl Picture<'_> {
    fn put(&mut self, text: std::fmt::Arguments<'_>) {
        // INVARIANT: writing to a string never fails.
        let _ = self.text.write_fmt(text);
    }

    fn open(&mut self) {
        let [left, top, width, height] = self.scene.view_box();
        let scale = LONGER_SIDE / f64::from(width.max(height));
        let pixels = |side: i32| (f64::from(side) * scale).ceil();
        self.put(format_args!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}\" height=\"{}\" viewBox=\"{left} {top} {width} {height}\">\n",
            pixels(width),
            pixels(height),
        ));
    }

    /// Draws the lines between and around the cells, half a cell longer at both ends.
    fn lines(&mut self) {
        let [left, top, width, height] = self.scene.view_box();
        let mut path = String::new();
        for col in left..left + width {
            let _ = write!(path, "M{col} {}v{height}", number(f64::from(top) - 0.5));
        }
        for row in top..top + height {
            let _ = write!(path, "M{} {row}h{width}", number(f64::from(left) - 0.5));
        }
        let color = self.scene.style.colors.obstacle;
        self.put(format_args!(
            "<path class=\"lines\" fill=\"none\" stroke=\"{color}\" stroke-width=\"{}\"{} transform=\"translate(.5 .5)\" d=\"{path}\"/>\n",
            number(size::STROKE),
            opacity_attribute(LINE_OPACITY),
        ));
    }

    /// Draws each obstacle as a small square, widened by a stroke with round corners.
    fn obstacles(&mut self) {
        let color = self.scene.style.colors.obstacle;
        let side = number(size::OBSTACLE - 2.0 * size::CORNER);
        let shift = number(-size::OBSTACLE / 2.0 + size::CORNER);
        self.put(format_args!(
            "<g class=\"obstacles\" fill=\"{color}\" stroke=\"{color}\" stroke-width=\"{}\" stroke-linejoin=\"round\" transform=\"translate({shift} {shift})\">\n",
            number(2.0 * size::CORNER),
        ));
        for Obstacles { seen, cells } in self.scene.obstacles() {
            let mut path = String::new();
            for (row, col) in cells {
                let _ = write!(path, "M{col} {row}h{side}v{side}h-{side}z");
            }
            let shaded = if seen == Some(0) { String::new() } else { opacity_attribute(SHADED) };
            self.put(format_args!("<path{shaded} d=\"{path}\""));
            let fade = seen
                .filter(|&frame| frame > 0)
                .zip(self.timing.as_ref())
                .map(|(frame, timing)| timing.numbers("opacity", |at| if at < frame { SHADED } else { 1.0 }));
            self.close("path", &[fade.flatten()]);
        }
        self.put(format_args!("</g>\n"));
    }

    fn agents(&mut self) {
        self.put(format_args!("<g class=\"agents\">\n"));
        for agent in self.scene.agents() {
            self.circle("a", "fill", agent, |scene, frame| scene.agent(agent, frame));
            let ink = (numbers::ink(self.scene.color(agent)), "");
            self.number(agent, ink, |scene, frame| scene.agent(agent, frame));
        }
        self.put(format_args!("</g>\n"));
    }

    fn goals(&mut self) {
        self.put(format_args!(
            "<g class=\"goals\" fill=\"none\" stroke-width=\"{}\">\n",
            number(size::STROKE)
        ));
        for agent in self.scene.goals() {
            self.circle("g", "stroke", agent, |scene, frame| scene.goal(agent, frame));
            // A halo, because the picture has no background and a page may be dark.
            let ink = (numbers::ink_of_goal(), HALO);
            self.number(agent, ink, |scene, frame| scene.goal(agent, frame));
        }
        self.put(format_args!("</g>\n"));
    }

    fn circle(&mut self, id: &str, painted: &str, agent: usize, look: impl Fn(&Scene<'_>, usize) -> Look) {
        let (first, color) = (look(self.scene, 0), self.scene.color(agent));
        self.put(format_args!(
            "<circle id=\"{id}{agent}\" r=\"{}\" cx=\"{}\" cy=\"{}\" {painted}=\"{color}\"{}{}",
            number(size::AGENT),
            first.cell.col,
            first.cell.row,
            opacity_attribute(first.opacity),
            visibility_attribute(first),
        ));
        self.animate("circle", "", look);
    }

    /// If the style shows numbers, writes the index of an agent in a colour, with the attributes of an outline.
    fn number(
        &mut self,
        agent: usize,
        (color, outline): (Color, &str),
        look: impl Fn(&Scene<'_>, usize) -> Look,
    ) {
        if !self.scene.style.show_numbers {
            return;
        }
        let (first, font_size) = (look(self.scene, 0), numbers::font_size(self.scene.num_agents()));
        self.put(format_args!(
            "<text x=\"{}\" y=\"{}\" font-family=\"{FONT}\" font-size=\"{}\" text-anchor=\"middle\" fill=\"{color}\"{outline}{}{}",
            first.cell.col,
            number(f64::from(first.cell.row) + numbers::baseline(font_size)),
            number(font_size),
            opacity_attribute(first.opacity),
            visibility_attribute(first),
        ));
        self.animate("text", &agent.to_string(), look);
    }

    /// Draws the dashed square around the cells that the agent sees.
    fn window(&mut self) {
        let Some(agent) = self.scene.window() else { return };
        let (first, color) = (self.scene.agent(agent, 0), self.scene.style.colors.own);
        let reach = self.scene.trace.header.config.radius as f64 + size::WINDOW;
        let side = number(2.0 * reach);
        self.put(format_args!(
            "<rect class=\"window\" x=\"{}\" y=\"{}\" width=\"{side}\" height=\"{side}\" rx=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"{}\" stroke-dasharray=\"{}\"{}",
            number(f64::from(first.cell.col) - reach),
            number(f64::from(first.cell.row) - reach),
            number(size::CORNER),
            number(size::STROKE),
            number(size::DASH),
            visibility_attribute(first),
        ));
        self.animate("rect", "", |scene, frame| scene.agent(agent, frame));
    }

    /// Closes the open element, with its text and its animations inside.
    fn animate(&mut self, tag: &str, text: &str, look: impl Fn(&Scene<'_>, usize) -> Look) {
        let Some(timing) = &self.timing else { return self.close(tag, &[Some(text.to_owned())]) };
        let look = |frame| look(self.scene, frame);
        let motion = timing.motion(|frame| look(frame).cell);
        let visibility = timing.visibility(|frame| look(frame).is_visible);
        let opacity = timing.numbers("opacity", |frame| look(frame).opacity);
        self.close(tag, &[Some(text.to_owned()), motion, visibility, opacity]);
    }

    fn close(&mut self, tag: &str, changes: &[Option<String>]) {
        let changes: String = changes.iter().flatten().map(String::as_str).collect();
        if changes.is_empty() {
            self.text.push_str("/>\n");
        } else {
            self.put(format_args!(">{changes}</{tag}>\n"));
        }
    }
}

fn opacity_attribute(opacity: f64) -> String {
    if opacity == 1.0 { String::new() } else { format!(" opacity=\"{}\"", number(opacity)) }
}

fn visibility_attribute(look: Look) -> &'static str {
    if look.is_visible { "" } else { " visibility=\"hidden\"" }
}
