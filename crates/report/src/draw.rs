//! The page: titles, frames, ticks, labels, legends and caption around the marks, as one SVG document.

use svg::node::element::{Description, Group, Line, Rectangle, SVG, Text, Title};

use crate::figure::{Figure, WIDTH_PX};
use crate::font::{FAMILIES, Font, Weight};
use crate::frame::{Rect, TICK_PX};
use crate::layout::{
    CAPTION_PX, LABEL_PX, LINE, Layout, PANEL_TITLE_PX, PanelLayout, REFERENCE_PX, TICK_GAP_PX, TICK_LENGTH_PX,
    TITLE_PX,
};
use crate::legend::{self, Legend};
use crate::marks::{Styles, drawn, number, swatch};
use crate::panel::Panel;
use crate::series::{Marks, Series};

const INK: &str = "#222222";
const SECONDARY_INK: &str = "#555555";
const GRID: &str = "#e3e3e3";
/// From a text's vertical middle down to its baseline, by its size.
const BASELINE: f64 = 0.36;

/// The whole figure.
pub(crate) fn document(figure: &Figure, layout: &Layout, font: &Font) -> String {
    let styles = Styles::of(figure);
    let size = format!("0 0 {} {}", number(WIDTH_PX), number(layout.height));
    let mut page = SVG::new()
        .set("width", number(WIDTH_PX))
        .set("height", number(layout.height))
        .set("viewBox", size)
        .set("role", "img")
        .set("font-family", FAMILIES)
        .set("fill", INK)
        .add(Title::new(figure.title.clone()))
        .add(Description::new().add(svg::node::Text::new(figure.caption.clone())))
        .add(Rectangle::new().set("width", "100%").set("height", "100%").set("fill", "#ffffff"));
    for (row, line) in layout.title.iter().enumerate() {
        let y = layout.margin + (row as f64 + 0.5) * TITLE_PX * LINE;
        page = page.add(text(line, layout.margin, y, TITLE_PX, "start").set("font-weight", "bold"));
    }
    for (panel, layout) in figure.panels.iter().zip(&layout.panels) {
        page = page.add(panel_group(panel, layout, &styles, font));
    }
    for (row, line) in layout.caption.iter().enumerate() {
        let y = layout.caption_y + (row as f64 + 0.5) * CAPTION_PX * LINE;
        page = page.add(text(line, layout.margin, y, CAPTION_PX, "start").set("fill", SECONDARY_INK));
    }
    let mut document = page.to_string();
    document.push('\n');
    document
}

/// A text with its vertical middle at `y`.
fn text(content: &str, x: f64, y: f64, size_px: f64, anchor: &str) -> Text {
    Text::new(content)
        .set("x", number(x))
        .set("y", number(y + BASELINE * size_px))
        .set("font-size", number(size_px))
        .set("text-anchor", anchor)
}

fn line(x1: f64, y1: f64, x2: f64, y2: f64, colour: &str) -> Line {
    let line = Line::new().set("x1", number(x1)).set("y1", number(y1)).set("x2", number(x2)).set("y2", number(y2));
    line.set("stroke", colour).set("stroke-width", "1")
}

fn panel_group(panel: &Panel, layout: &PanelLayout, styles: &Styles, font: &Font) -> Group {
    let mut group = Group::new().set("class", "panel");
    for (row, content) in layout.title.iter().enumerate() {
        let y = layout.title_y + (row as f64 + 0.5) * PANEL_TITLE_PX * LINE;
        group = group.add(text(content, layout.title_x, y, PANEL_TITLE_PX, "start").set("font-weight", "bold"));
    }
    let frame = &layout.frame;
    group = group.add(axes(panel, layout, font));
    let layer = |series: &&Series, wanted: usize| {
        wanted
            == match series.marks {
                Marks::Band { .. } | Marks::Bars { .. } => 0,
                Marks::HorizontalLine { .. } | Marks::VerticalLine { .. } => 1,
                Marks::Line { .. } => 2,
                Marks::Points { .. } => 3,
            }
    };
    let marks = |wanted: usize| {
        let series = panel.series.iter().filter(move |series| layer(series, wanted));
        series.map(|series| drawn(series, styles.style(series), frame))
    };
    let mut clipped = clip(&frame.rect);
    for wanted in 0..3 {
        clipped = marks(wanted).fold(clipped, SVG::add);
    }
    group = group.add(clipped).add(outline(&frame.rect).set("class", "frame").set("fill", "none").set("stroke", INK));
    group = marks(3).fold(group, Group::add);
    for label in &layout.references {
        let series = &panel.series[label.series];
        let anchor = if matches!(series.marks, Marks::HorizontalLine { .. }) { "start" } else { "middle" };
        for (row, content) in label.lines.iter().enumerate() {
            let y = label.y + row as f64 * REFERENCE_PX * 1.2;
            let colour = styles.style(series).colour;
            group = group.add(text(content, label.x, y, REFERENCE_PX, anchor).set("fill", colour));
        }
    }
    match &layout.legend {
        Some(legend) => group.add(legend_group(legend, panel, layout, styles, font)),
        None => group,
    }
}

/// A view of the page that ends at the frame. (A clip path would need an id, and ids of two figures on one
/// page clash.)
fn clip(rect: &Rect) -> SVG {
    let [x, y, w, h] = [rect.x, rect.y, rect.w, rect.h].map(number);
    let view = format!("{x} {y} {w} {h}");
    SVG::new().set("x", x).set("y", y).set("width", w).set("height", h).set("viewBox", view).set("overflow", "hidden")
}

fn outline(rect: &Rect) -> Rectangle {
    let [x, y, w, h] = [rect.x, rect.y, rect.w, rect.h].map(number);
    Rectangle::new().set("x", x).set("y", y).set("width", w).set("height", h)
}

fn axes(panel: &Panel, layout: &PanelLayout, font: &Font) -> Group {
    let frame = &layout.frame;
    let Rect { x: left, y: top, w, h } = frame.rect;
    let (right, bottom) = (left + w, top + h);
    let mut group = Group::new().set("class", "axes");
    for tick in &layout.x_ticks {
        let x = frame.x_px(tick.value);
        let length = if tick.label.is_some() { TICK_LENGTH_PX } else { TICK_LENGTH_PX / 2.0 };
        if let Some(label) = &tick.label {
            group = group.add(line(x, top, x, bottom, GRID));
            for (row, label) in label.lines().enumerate() {
                let y = bottom + TICK_GAP_PX + TICK_PX / 2.0 + row as f64 * TICK_PX * LINE;
                group = group.add(text(label, x, y, TICK_PX, "middle"));
            }
        }
        group = group.add(line(x, bottom, x, bottom + length, INK));
    }
    for tick in &layout.y_ticks {
        let y = frame.y_px(tick.value);
        let length = if tick.label.is_some() { TICK_LENGTH_PX } else { TICK_LENGTH_PX / 2.0 };
        if let Some(label) = &tick.label {
            group = group.add(line(left, y, right, y, GRID)).add(text(label, left - TICK_GAP_PX, y, TICK_PX, "end"));
        }
        group = group.add(line(left - length, y, left, y, INK));
    }
    let x_px = font.fitting_px(&panel.x.label, LABEL_PX, Weight::Regular, layout.cell.1);
    let x_y = bottom + TICK_GAP_PX + layout.tick_lines_px() + 8.0 + LABEL_PX / 2.0;
    let half = font.width_px(&panel.x.label, x_px, Weight::Regular) / 2.0;
    // In the middle of the frame, unless it is so long that it would leave the column.
    let x_x = (left + w / 2.0).min(layout.cell.0 + layout.cell.1 - half).max(layout.cell.0 + half);
    let y_px = font.fitting_px(&panel.y.label, LABEL_PX, Weight::Regular, h + 2.0 * LABEL_PX);
    let (y_x, y_y) = (left - layout.y_label_gap, top + h / 2.0);
    let turned = format!("rotate(-90 {} {})", number(y_x), number(y_y));
    group
        .add(text(&panel.x.label, x_x, x_y, x_px, "middle"))
        .add(text(&panel.y.label, y_x, y_y, y_px, "middle").set("transform", turned))
}

fn legend_group(legend: &Legend, panel: &Panel, layout: &PanelLayout, styles: &Styles, font: &Font) -> Group {
    let mut group = Group::new().set("class", "legend");
    let (x, y) = legend.inside.unwrap_or_else(|| {
        let middle = layout.frame.rect.x + layout.frame.rect.w / 2.0 - legend.width / 2.0;
        (middle.min(layout.cell.0 + layout.cell.1 - legend.width).max(layout.cell.0), layout.legend_y)
    });
    if legend.inside.is_some() {
        let rect = Rect { x, y, w: legend.width, h: legend.height };
        group = group.add(outline(&rect).set("fill", "#ffffff").set("fill-opacity", "0.9").set("stroke", "#cccccc"));
    }
    for entry in &legend.entries {
        let middle = y + entry.y + legend::ROW_PX / 2.0;
        for &index in &entry.series {
            let series = &panel.series[index];
            group = group.add(swatch(series, styles.style(series), x + entry.x, middle));
        }
        let text_x = x + entry.text_x();
        let room = layout.cell.0 + layout.cell.1 - text_x;
        let size_px = font.fitting_px(&entry.text, legend::TEXT_PX, Weight::Regular, room);
        group = group.add(text(&entry.text, text_x, middle, size_px, "start"));
    }
    group
}
