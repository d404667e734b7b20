//! Combines plots into a larger scene.

use kuva::render::layout::Layout;
use kuva::render::plots::Plot;
use kuva::render::render::{Primitive, Scene, render_multiple};

/// Draws plots without their axes.
pub(super) fn bare(plots: Vec<Plot>, layout: Layout) -> Scene {
    let mut scene = render_multiple(plots, layout);
    // The axes come first, then the content clipped to them.
    let first = scene.elements.iter().position(|element| matches!(element, Primitive::ClipStart { .. }));
    scene.elements.drain(..first.unwrap_or(0));
    scene
}

/// Returns a layout without axes or margins, filled by the plot.
pub(super) fn plain_layout((width, height): (f64, f64), x: (f64, f64), y: (f64, f64)) -> Layout {
    let mut layout = Layout::new(x, y)
        .with_width(width)
        .with_height(height)
        .with_show_grid(false)
        .with_force_margins(0.0, 0.0)
        .with_force_margins_y(0.0, 0.0)
        .with_x_axis_min(x.0)
        .with_x_axis_max(x.1)
        .with_y_axis_min(y.0)
        .with_y_axis_max(y.1);
    (layout.suppress_x_ticks, layout.suppress_y_ticks, layout.show_legend) = (true, true, false);
    layout
}

/// Inserts one scene into another at a position.
pub(super) fn insert(scene: &mut Scene, part: Scene, (x, y): (f64, f64)) {
    scene.font_family = scene.font_family.take().or(part.font_family);
    scene.defs.extend(part.defs);
    let transform = Some(format!("translate({x},{y})"));
    scene.add(Primitive::GroupStart { transform, title: None, extra_attrs: None });
    scene.elements.extend(part.elements);
    scene.add(Primitive::GroupEnd);
}
