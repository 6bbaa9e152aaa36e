//! Where everything of a figure stands. Frames of one figure are equally wide, and a legend below a panel
//! makes the figure higher, not the frame smaller; what a frame shows therefore does not depend on where its
//! legend found room.

use crate::axis::Range;
use crate::figure::{Figure, WIDTH_PX};
use crate::font::{Font, Weight};
use crate::frame::{Frame, Rect, TICK_PX};
use crate::legend::Legend;
use crate::panel::Panel;
use crate::series::Marks;
use crate::ticks::Tick;

pub(crate) const TITLE_PX: f64 = 18.0;
pub(crate) const PANEL_TITLE_PX: f64 = 14.0;
pub(crate) const LABEL_PX: f64 = 13.0;
pub(crate) const REFERENCE_PX: f64 = 11.5;
pub(crate) const CAPTION_PX: f64 = 11.5;
/// The distance between lines of text, by the text's size.
pub(crate) const LINE: f64 = 1.35;
pub(crate) const TICK_LENGTH_PX: f64 = 5.0;
/// From the frame to the tick labels.
pub(crate) const TICK_GAP_PX: f64 = 8.0;

/// Between the names of two places on an axis.
const NAME_GAP_PX: f64 = 10.0;
const MARGIN_PX: f64 = 16.0;
const COLUMN_GAP_PX: f64 = 22.0;
const ROW_GAP_PX: f64 = 20.0;
const REFERENCE_WRAP_PX: f64 = 100.0;
const MIN_WIDTH_PX: f64 = 60.0;
const HEIGHT_BY_WIDTH: f64 = 0.75;
const HEIGHT_PX: std::ops::RangeInclusive<f64> = 170.0..=400.0;
/// Of a frame with equal aspect, by its width, and absolutely at most.
const EQUAL_ASPECT_HEIGHTS: (f64, f64, f64) = (0.4, 1.1, 620.0);

/// The name of a reference line, in place.
#[derive(Clone, Debug)]
pub(crate) struct ReferenceLabel {
    pub(crate) series: usize,
    pub(crate) lines: Vec<String>,
    /// The left end beside the frame, the middle above it.
    pub(crate) x: f64,
    /// The middle of the first line.
    pub(crate) y: f64,
}

/// A panel in place.
#[derive(Clone, Debug)]
pub(crate) struct PanelLayout {
    /// The column's left end and width.
    pub(crate) cell: (f64, f64),
    pub(crate) title: Vec<String>,
    pub(crate) title_x: f64,
    pub(crate) title_y: f64,
    pub(crate) frame: Frame,
    pub(crate) x_ticks: Vec<Tick>,
    pub(crate) y_ticks: Vec<Tick>,
    /// From the frame's left end to the middle of the label of y.
    pub(crate) y_label_gap: f64,
    pub(crate) references: Vec<ReferenceLabel>,
    pub(crate) legend: Option<Legend>,
    /// Where a legend below the panel begins.
    pub(crate) legend_y: f64,
}

/// A figure in place.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    pub(crate) title: Vec<String>,
    pub(crate) panels: Vec<PanelLayout>,
    pub(crate) caption: Vec<String>,
    pub(crate) caption_y: f64,
    pub(crate) height: f64,
    pub(crate) margin: f64,
}

impl Layout {
    pub(crate) fn of(figure: &Figure, font: &Font) -> Self {
        let columns = figure.columns.min(figure.panels.len());
        let room = WIDTH_PX - 2.0 * MARGIN_PX;
        let margins = margins(figure, font, columns, room);
        let frame_w = frame_width(&margins, room);
        let title = font.wrap(&figure.title, TITLE_PX, Weight::Bold, room);
        let mut y = MARGIN_PX + title.len() as f64 * TITLE_PX * LINE + if title.is_empty() { 0.0 } else { 8.0 };
        let mut panels = Vec::new();
        for (row_number, row) in figure.panels.chunks(columns).enumerate() {
            if row_number > 0 {
                y += ROW_GAP_PX;
            }
            let mut x = MARGIN_PX;
            let place = |(panel, &(left, right)): (&Panel, &(f64, f64))| {
                let cell = (x, left + frame_w + right);
                x += cell.1 + COLUMN_GAP_PX;
                PanelLayout::of(panel, font, cell, left, right)
            };
            let mut placed: Vec<PanelLayout> = row.iter().zip(&margins).map(place).collect();
            let most = |of: &dyn Fn(&PanelLayout) -> f64| placed.iter().map(of).fold(0.0, f64::max);
            let titles = most(&|panel| panel.title.len() as f64 * PANEL_TITLE_PX * LINE);
            let above = most(&|panel| panel.height_above());
            let below = most(&|panel| panel.frame.rect.h + panel.height_below());
            for panel in &mut placed {
                panel.title_y = y;
                panel.shift_down(y + titles + above + 4.0);
            }
            panels.extend(placed);
            y += titles + above + 4.0 + below;
        }
        let caption = font.wrap(&figure.caption, CAPTION_PX, Weight::Regular, room);
        let caption_y = y + 10.0;
        let height = (caption_y + caption.len() as f64 * CAPTION_PX * LINE + MARGIN_PX - 4.0).ceil();
        Self { title, panels, caption, caption_y, height, margin: MARGIN_PX }
    }
}

/// What columns leave for each frame beside their margins.
fn frame_width(margins: &[(f64, f64)], room: f64) -> f64 {
    let taken: f64 = margins.iter().map(|(left, right)| left + right).sum();
    let gaps = (margins.len() - 1) as f64 * COLUMN_GAP_PX;
    ((room - gaps - taken) / margins.len() as f64).max(MIN_WIDTH_PX)
}

/// What the widest labels of each column need left and right of its frames. Wider margins mean narrower
/// frames and other ticks; they only grow, so this ends.
fn margins(figure: &Figure, font: &Font, columns: usize, room: f64) -> Vec<(f64, f64)> {
    let width = |text: &str, size_px| font.width_px(text, size_px, Weight::Regular);
    let mut margins = vec![(0.0_f64, 0.0_f64); columns];
    loop {
        let before = margins.clone();
        let frame_w = frame_width(&before, room);
        for (number, panel) in figure.panels.iter().enumerate() {
            let (left, right) = &mut margins[number % columns];
            let frame = frame(panel, frame_w);
            let widest = |ticks: Vec<Tick>| {
                let lines = ticks.iter().filter_map(|tick| tick.label.as_deref()).flat_map(str::lines);
                lines.map(|line| width(line, TICK_PX)).fold(0.0, f64::max)
            };
            *left = left.max(widest(frame.y_ticks()) + TICK_GAP_PX + 6.0 + LABEL_PX * LINE);
            *right = right.max(widest(x_ticks(panel, &frame, font)) / 2.0 + 2.0);
            for series in panel.series.iter().filter(|series| matches!(series.marks, Marks::HorizontalLine { .. })) {
                for line in font.wrap(&series.name, REFERENCE_PX, Weight::Regular, REFERENCE_WRAP_PX) {
                    *right = right.max(width(&line, REFERENCE_PX) + 8.0);
                }
            }
        }
        if margins == before {
            return margins;
        }
    }
}

/// The frame of a panel with its upper left corner at the origin.
fn frame(panel: &Panel, width: f64) -> Frame {
    let (x, y) = panel.spans();
    let (low, high) = (*HEIGHT_PX.start(), *HEIGHT_PX.end());
    let rect = Rect { x: 0.0, y: 0.0, w: width, h: (HEIGHT_BY_WIDTH * width).clamp(low, high) };
    let mut frame = Frame { rect, x, y };
    if panel.equal_aspect {
        let (least, most, most_px) = EQUAL_ASPECT_HEIGHTS;
        let natural = width * y.length() / x.length();
        frame.rect.h = natural.clamp(least * width, (most * width).min(most_px));
        if natural > frame.rect.h {
            match panel.x.range {
                Range::Auto => frame.x = x.stretched_to(y.length() * width / frame.rect.h),
                Range::Fixed { .. } => frame.rect.w = frame.rect.h * x.length() / y.length(),
            }
        } else {
            match panel.y.range {
                Range::Auto => frame.y = y.stretched_to(x.length() * frame.rect.h / width),
                Range::Fixed { .. } => frame.rect.h = natural,
            }
        }
    }
    frame
}

impl PanelLayout {
    /// A panel with the upper end of its frame at y = 0.
    fn of(panel: &Panel, font: &Font, cell: (f64, f64), left: f64, right: f64) -> Self {
        let mut frame = frame(panel, cell.1 - left - right);
        frame.rect.x = cell.0 + left + (cell.1 - left - right - frame.rect.w) / 2.0;
        let legend = Legend::of(panel, &frame, font, cell.1);
        let title = font.wrap(&panel.title, PANEL_TITLE_PX, Weight::Bold, cell.1 - left);
        let mut references = beside(panel, &frame, font);
        references.extend(above(panel, &frame, font, cell));
        let y_ticks = frame.y_ticks();
        let widest = y_ticks
            .iter()
            .filter_map(|tick| tick.label.as_deref())
            .map(|label| font.width_px(label, TICK_PX, Weight::Regular))
            .fold(0.0, f64::max);
        Self {
            cell,
            title,
            title_x: cell.0 + left,
            title_y: 0.0,
            x_ticks: x_ticks(panel, &frame, font),
            y_ticks,
            y_label_gap: widest + TICK_GAP_PX + 6.0 + LABEL_PX * LINE / 2.0,
            frame,
            references,
            legend,
            legend_y: 0.0,
        }
    }

    fn height_above(&self) -> f64 {
        let highest = self.references.iter().map(|label| label.y).fold(0.0, f64::min);
        if highest < 0.0 { REFERENCE_PX - highest } else { 6.0 }
    }

    fn height_of_axis(&self) -> f64 {
        TICK_GAP_PX + self.tick_lines_px() + 8.0 + LABEL_PX * LINE
    }

    /// What the labels below the frame take: numbers one line, names as many as the longest.
    pub(crate) fn tick_lines_px(&self) -> f64 {
        let labels = self.x_ticks.iter().filter_map(|tick| tick.label.as_deref());
        let lines = labels.map(|label| label.lines().count()).max().unwrap_or(1);
        TICK_PX * (1.0 + (lines.max(1) - 1) as f64 * LINE)
    }

    fn height_below(&self) -> f64 {
        let legend = self.legend.as_ref().filter(|legend| legend.inside.is_none());
        self.height_of_axis() + legend.map_or(0.0, |legend| 6.0 + legend.height)
    }

    fn shift_down(&mut self, by: f64) {
        self.frame.rect.y += by;
        self.legend_y = by + self.frame.rect.h + self.height_of_axis() + 6.0;
        for label in &mut self.references {
            label.y += by;
        }
        if let Some((_, y)) = self.legend.as_mut().and_then(|legend| legend.inside.as_mut()) {
            *y += by;
        }
    }
}

/// Ticks along: round numbers, or the names of the places, broken where they are wider than their place.
fn x_ticks(panel: &Panel, frame: &Frame, font: &Font) -> Vec<Tick> {
    if panel.x.names.is_empty() {
        return frame.x_ticks(font);
    }
    let room = frame.rect.w / panel.x.names.len() as f64 - NAME_GAP_PX;
    let label = |name: &String| {
        let mut lines = vec![String::new()];
        for part in name.split_inclusive(['_', ' ']) {
            let last = lines.len() - 1;
            let with = format!("{}{part}", lines[last]);
            if lines[last].is_empty() || font.width_px(&with, TICK_PX, Weight::Regular) <= room {
                lines[last] = with;
            } else {
                lines.push(part.to_owned());
            }
        }
        lines.join("\n")
    };
    (1..).map(f64::from).zip(&panel.x.names).map(|(value, name)| Tick { value, label: Some(label(name)) }).collect()
}

/// Names of horizontal references, right of the frame, pushed apart where lines are close.
fn beside(panel: &Panel, frame: &Frame, font: &Font) -> Vec<ReferenceLabel> {
    let line_px = REFERENCE_PX * 1.2;
    let mut labels: Vec<ReferenceLabel> = Vec::new();
    for (series, it) in panel.series.iter().enumerate() {
        if let Marks::HorizontalLine { y } = it.marks {
            let lines = font.wrap(&it.name, REFERENCE_PX, Weight::Regular, REFERENCE_WRAP_PX);
            let y = frame.y_px(y) - (lines.len() as f64 - 1.0) / 2.0 * line_px;
            labels.push(ReferenceLabel { series, lines, x: frame.rect.x + frame.rect.w + 7.0, y });
        }
    }
    labels.sort_by(|a, b| a.y.total_cmp(&b.y));
    let height = |label: &ReferenceLabel| label.lines.len() as f64 * line_px + 1.0;
    // Overlapping neighbours part by equal amounts; each pass moves fewer.
    for _ in 0..4 * labels.len() {
        for k in 1..labels.len() {
            let overlap = labels[k - 1].y + height(&labels[k - 1]) - labels[k].y;
            if overlap > 0.0 {
                labels[k - 1].y -= overlap / 2.0;
                labels[k].y += overlap / 2.0;
            }
        }
    }
    labels
}

/// Names of vertical references, above the frame, in as many rows as keeps them apart.
fn above(panel: &Panel, frame: &Frame, font: &Font, cell: (f64, f64)) -> Vec<ReferenceLabel> {
    let mut wanted: Vec<(usize, f64, f64)> = Vec::new();
    for (series, it) in panel.series.iter().enumerate() {
        if let Marks::VerticalLine { x } = it.marks {
            let half = font.width_px(&it.name, REFERENCE_PX, Weight::Regular) / 2.0;
            let (first, last) = (cell.0 + half, cell.0 + cell.1 - half);
            wanted.push((series, frame.x_px(x).min(last).max(first), half));
        }
    }
    wanted.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut row_ends: Vec<f64> = Vec::new();
    let mut labels = Vec::new();
    for (series, x, half) in wanted {
        let free = row_ends.iter().position(|&end| end + 10.0 <= x - half);
        let row = free.unwrap_or_else(|| {
            row_ends.push(0.0);
            row_ends.len() - 1
        });
        row_ends[row] = x + half;
        let y = -6.0 - REFERENCE_PX / 2.0 - row as f64 * REFERENCE_PX * LINE;
        labels.push(ReferenceLabel { series, lines: vec![panel.series[series].name.clone()], x, y });
    }
    labels
}
