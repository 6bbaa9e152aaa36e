//! Marks on paper: their styles, what they cover, and their SVG.

use svg::node::element::{Circle, Group, Line, Path, Rectangle, Title};

use crate::figure::Figure;
use crate::frame::{Frame, Rect};
use crate::panel::Panel;
use crate::series::{Colour, Marks, Series};

const REFERENCE_COLOUR: &str = "#555555";
const REFERENCE_DASHES: &str = "6 4";
/// The width of a swatch in the legend.
pub(crate) const SWATCH_PX: f64 = 32.0;
const LINE_PX: f64 = 1.9;
const CAP_PX: f64 = 3.5;
/// Dashes tell lines apart where colours cannot, on grey paper.
const DASHES: [&str; 5] = ["none", "9 4", "2.5 3", "10 3 2.5 3", "5 2.5"];
/// How fine covered places are sampled for the legend to keep clear of them.
const SAMPLE_PX: f64 = 4.0;
/// Lines leave a frame at most this far, so that their ends fit in the numbers of any viewer.
const FAR_PX: f64 = 1e6;
/// Points of a line that are nearer than this to the one before are left out: nobody can see them.
const INVISIBLE_PX: f64 = 0.1;

/// The form of a marker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Marker {
    Circle,
    Square,
    Triangle,
    Diamond,
    TriangleDown,
}

/// How the series of one name look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Style {
    pub(crate) colour: &'static str,
    dashes: &'static str,
    marker: Marker,
}

/// The styles of all names of a figure, given in order of appearance.
#[derive(Clone, Debug)]
pub(crate) struct Styles(Vec<(String, Style)>);

impl Styles {
    pub(crate) fn of(figure: &Figure) -> Self {
        let series = || figure.panels.iter().flat_map(|panel| &panel.series).filter(|series| !series.is_reference());
        let taken: Vec<Colour> = series().filter_map(|series| series.colour).collect();
        let mut free: Vec<Colour> = Colour::IN_TURN.into_iter().filter(|colour| !taken.contains(colour)).collect();
        if free.is_empty() {
            free = Colour::IN_TURN.to_vec();
        }
        let mut turns = free.into_iter().cycle();
        let mut styles: Vec<(String, Style)> = Vec::new();
        for it in series() {
            if styles.iter().any(|(name, _)| *name == it.name) {
                continue;
            }
            let own = series().filter(|other| other.name == it.name).find_map(|other| other.colour);
            let colour = own.or_else(|| turns.next()).unwrap_or(Colour::Black).hex();
            let markers = [Marker::Circle, Marker::Square, Marker::Triangle, Marker::Diamond, Marker::TriangleDown];
            let number = styles.len();
            let style =
                Style { colour, dashes: DASHES[number % DASHES.len()], marker: markers[number % markers.len()] };
            styles.push((it.name.clone(), style));
        }
        Self(styles)
    }

    pub(crate) fn style(&self, series: &Series) -> Style {
        let own = series.colour.map(Colour::hex);
        let named = self.0.iter().find(|(name, _)| *name == series.name).filter(|_| !series.is_reference());
        let reference = Style { colour: REFERENCE_COLOUR, dashes: REFERENCE_DASHES, marker: Marker::Circle };
        let style = named.map_or(reference, |(_, style)| *style);
        Style { colour: own.unwrap_or(style.colour), ..style }
    }
}

/// A coordinate as SVG shows it: hundredths of a pixel.
pub(crate) fn number(px: f64) -> String {
    let text = format!("{px:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

fn path(points: &[(f64, f64)], closed: bool) -> String {
    let mut d = String::new();
    for (k, &(x, y)) in points.iter().enumerate() {
        d.push_str(if k == 0 { "M" } else { " L" });
        d.push_str(&format!("{} {}", number(x), number(y)));
    }
    if closed {
        d.push_str(" Z");
    }
    d
}

fn near(frame: &Frame, point: (f64, f64)) -> (f64, f64) {
    let (x, y) = frame.px(point.0, point.1);
    (x.clamp(-FAR_PX, FAR_PX), y.clamp(-FAR_PX, FAR_PX))
}

fn thinned(points: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    let mut kept: Vec<(f64, f64)> = Vec::new();
    let mut left_out = None;
    for (x, y) in points {
        let seen = kept.last().is_none_or(|last| (x - last.0).hypot(y - last.1) >= INVISIBLE_PX);
        left_out = if seen { None } else { Some((x, y)) };
        if seen {
            kept.push((x, y));
        }
    }
    kept.extend(left_out);
    kept
}

/// The ends of an error bar inside the frame, upper first, and whether each is a real end with a cap.
fn whisker(frame: &Frame, y: f64, error: f64) -> [(f64, bool); 2] {
    let (top, bottom) = (frame.rect.y, frame.rect.y + frame.rect.h);
    let end = |value: f64, outside: f64| {
        if frame.y.contains(value) { (frame.y_px(value), true) } else { (outside, false) }
    };
    [end(y + error, top), end(y - error, bottom)]
}

/// How many points or bars of a series the frame does not show.
pub(crate) fn beyond(series: &Series, frame: &Frame) -> usize {
    match &series.marks {
        Marks::Points { points, .. } => {
            points.iter().filter(|&&(x, y)| !(frame.x.contains(x) && frame.y.contains(y))).count()
        }
        Marks::Bars { edges, heights } => {
            let outside = |k: usize| edges[k + 1] <= frame.x.low || edges[k] >= frame.x.high;
            (0..heights.len()).filter(|&k| outside(k) && heights[k] != 0.0).count()
        }
        _ => 0,
    }
}

/// Places on paper that the marks of a panel cover, sampled.
pub(crate) fn covered_points(panel: &Panel, frame: &Frame) -> Vec<(f64, f64)> {
    let mut covered = Vec::new();
    let mut cover = |from: (f64, f64), to: (f64, f64)| {
        let steps = ((to.0 - from.0).hypot(to.1 - from.1) / SAMPLE_PX).ceil().clamp(1.0, 5000.0) as usize;
        covered.extend((0..=steps).map(|k| {
            let part = k as f64 / steps as f64;
            (from.0 + part * (to.0 - from.0), from.1 + part * (to.1 - from.1))
        }));
    };
    let rect = &frame.rect;
    for series in &panel.series {
        match &series.marks {
            Marks::Line { points } => {
                let points = thinned(points.iter().map(|&point| near(frame, point)));
                points.windows(2).for_each(|pair| cover(pair[0], pair[1]));
            }
            Marks::Points { points, y_error } => {
                for (k, &(x, y)) in points.iter().enumerate() {
                    let [(top, _), (bottom, _)] = whisker(frame, y, y_error.as_ref().map_or(0.0, |errors| errors[k]));
                    cover((frame.x_px(x), top), (frame.x_px(x), bottom));
                }
            }
            Marks::Band { x, low, high } => {
                for k in 1..x.len() {
                    let (a, b) = (near(frame, (x[k - 1], low[k - 1])), near(frame, (x[k - 1], high[k - 1])));
                    let (c, d) = (near(frame, (x[k], low[k])), near(frame, (x[k], high[k])));
                    let steps = ((c.0 - a.0) / SAMPLE_PX).ceil().clamp(1.0, 500.0);
                    let mut part = 0.0;
                    while part <= 1.0 {
                        let at = |from: (f64, f64), to: (f64, f64)| {
                            (from.0 + part * (to.0 - from.0), from.1 + part * (to.1 - from.1))
                        };
                        cover(at(a, c), at(b, d));
                        part += 1.0 / steps;
                    }
                }
            }
            Marks::Bars { edges, heights } => {
                for (edge, &height) in edges.windows(2).zip(heights) {
                    let (left, right) = (frame.x_px(edge[0]).max(rect.x), frame.x_px(edge[1]).min(rect.x + rect.w));
                    let mut x = left;
                    while x <= right {
                        cover((x, frame.y_px(0.0)), (x, frame.y_px(height)));
                        x += SAMPLE_PX;
                    }
                }
            }
            Marks::HorizontalLine { y } => cover((rect.x, frame.y_px(*y)), (rect.x + rect.w, frame.y_px(*y))),
            Marks::VerticalLine { x } => cover((frame.x_px(*x), rect.y), (frame.x_px(*x), rect.y + rect.h)),
        }
    }
    covered.retain(|&point| rect.contains(point.0, point.1));
    covered
}

/// The marks of a series, in a group that a browser names when pointed at.
pub(crate) fn drawn(series: &Series, style: Style, frame: &Frame) -> Group {
    let group = Group::new().set("class", "series").add(Title::new(series.name.clone()));
    let rect = &frame.rect;
    match &series.marks {
        Marks::Line { points } => {
            group.add(curve(&thinned(points.iter().map(|&point| near(frame, point))), style, "line"))
        }
        Marks::Points { points, y_error } => {
            let (radius, opacity) = match points.len() {
                0..=60 => (3.8, 1.0),
                61..=300 => (2.6, 0.9),
                _ => (2.0, 0.5),
            };
            let mut group = group;
            for (k, &(x, y)) in points.iter().enumerate() {
                if !(frame.x.contains(x) && frame.y.contains(y)) {
                    continue;
                }
                let (x_px, y_px) = frame.px(x, y);
                if let Some(errors) = y_error {
                    group = error_bar(group, x_px, whisker(frame, y, errors[k]), style);
                }
                group = marker(group, x_px, y_px, radius, opacity, style);
            }
            group
        }
        Marks::Band { x, low, high } => {
            let edge = |ys: &[f64]| x.iter().zip(ys).map(|(&x, &y)| near(frame, (x, y))).collect::<Vec<_>>();
            let (low, high) = (edge(low), edge(high));
            let outline: Vec<(f64, f64)> = high.iter().copied().chain(low.iter().rev().copied()).collect();
            band(group, &outline, style).add(thin(&low, style)).add(thin(&high, style))
        }
        Marks::Bars { edges, heights } => edges.windows(2).zip(heights).fold(group, |group, (edge, &height)| {
            let (left, top) = near(frame, (edge[0], height.max(0.0)));
            let (right, bottom) = near(frame, (edge[1], height.min(0.0)));
            bar(group, Rect { x: left, y: top, w: right - left, h: bottom - top }, style)
        }),
        Marks::HorizontalLine { y } => {
            let y = frame.y_px(*y);
            group.add(reference(&[(rect.x, y), (rect.x + rect.w, y)], style))
        }
        Marks::VerticalLine { x } => {
            let x = frame.x_px(*x);
            group.add(reference(&[(x, rect.y), (x, rect.y + rect.h)], style))
        }
    }
}

/// The same marks in a legend's row, from `x` and around `y`.
pub(crate) fn swatch(series: &Series, style: Style, x: f64, y: f64) -> Group {
    let group = Group::new().set("class", "swatch");
    let ends = |dy: f64| [(x, y + dy), (x + SWATCH_PX, y + dy)];
    match &series.marks {
        Marks::Line { .. } => group.add(curve(&ends(0.0), style, "line")),
        Marks::Points { y_error, .. } => {
            let middle = x + SWATCH_PX / 2.0;
            let group = match y_error {
                Some(_) => error_bar(group, middle, [(y - 7.0, true), (y + 7.0, true)], style),
                None => group,
            };
            marker(group, middle, y, 3.8, 1.0, style)
        }
        Marks::Band { .. } => {
            let outline = [ends(-6.0)[0], ends(-6.0)[1], ends(6.0)[1], ends(6.0)[0]];
            band(group, &outline, style).add(thin(&ends(-6.0), style)).add(thin(&ends(6.0), style))
        }
        Marks::Bars { .. } => bar(group, Rect { x: x + 5.0, y: y - 6.0, w: SWATCH_PX - 10.0, h: 12.0 }, style),
        Marks::HorizontalLine { .. } | Marks::VerticalLine { .. } => group.add(reference(&ends(0.0), style)),
    }
}

fn stroked(points: &[(f64, f64)], style: Style, class: &str, width: f64) -> Path {
    Path::new()
        .set("class", class)
        .set("d", path(points, false))
        .set("fill", "none")
        .set("stroke", style.colour)
        .set("stroke-width", number(width))
        .set("stroke-dasharray", style.dashes)
        .set("stroke-linejoin", "round")
}

fn curve(points: &[(f64, f64)], style: Style, class: &str) -> Path {
    stroked(points, style, class, LINE_PX)
}

fn thin(points: &[(f64, f64)], style: Style) -> Path {
    stroked(points, style, "band-edge", 0.9).set("stroke-opacity", "0.7")
}

fn reference(points: &[(f64, f64)], style: Style) -> Path {
    stroked(points, Style { dashes: REFERENCE_DASHES, ..style }, "reference", 1.4)
}

fn band(group: Group, outline: &[(f64, f64)], style: Style) -> Group {
    let area = Path::new().set("class", "band").set("d", path(outline, true));
    group.add(area.set("fill", style.colour).set("fill-opacity", "0.2"))
}

fn bar(group: Group, Rect { x, y, w, h }: Rect, style: Style) -> Group {
    let bar = Rectangle::new()
        .set("class", "bar")
        .set("x", number(x))
        .set("y", number(y))
        .set("width", number(w))
        .set("height", number(h))
        .set("fill", style.colour)
        .set("fill-opacity", "0.35")
        .set("stroke", style.colour)
        .set("stroke-dasharray", style.dashes)
        .set("stroke-width", "1");
    group.add(bar)
}

fn error_bar(group: Group, x: f64, ends: [(f64, bool); 2], style: Style) -> Group {
    let line = |x1: f64, y1: f64, x2: f64, y2: f64, class: &str| {
        let line = Line::new().set("class", class).set("stroke", style.colour).set("stroke-width", "1.3");
        line.set("x1", number(x1)).set("y1", number(y1)).set("x2", number(x2)).set("y2", number(y2))
    };
    let group = group.add(line(x, ends[0].0, x, ends[1].0, "error"));
    let caps = ends.iter().filter(|(_, capped)| *capped);
    caps.fold(group, |group, &(y, _)| group.add(line(x - CAP_PX, y, x + CAP_PX, y, "cap")))
}

fn marker(group: Group, x: f64, y: f64, radius: f64, opacity: f64, style: Style) -> Group {
    // Equal areas look equally large: forms with corners reach further than a circle.
    let r = radius;
    let corners = |corners: &[(f64, f64)]| {
        path(&corners.iter().map(|(dx, dy)| (x + dx * r, y + dy * r)).collect::<Vec<_>>(), true)
    };
    let d = match style.marker {
        Marker::Circle => {
            let circle = Circle::new().set("class", "point").set("cx", number(x)).set("cy", number(y));
            let circle = circle.set("r", number(r)).set("fill", style.colour).set("fill-opacity", number(opacity));
            return group.add(circle);
        }
        Marker::Square => corners(&[(-0.89, -0.89), (0.89, -0.89), (0.89, 0.89), (-0.89, 0.89)]),
        Marker::Triangle => corners(&[(0.0, -1.35), (1.17, 0.8), (-1.17, 0.8)]),
        Marker::Diamond => corners(&[(0.0, -1.35), (1.17, 0.0), (0.0, 1.35), (-1.17, 0.0)]),
        Marker::TriangleDown => corners(&[(0.0, 1.35), (1.17, -0.8), (-1.17, -0.8)]),
    };
    let shape = Path::new().set("class", "point").set("d", d).set("fill", style.colour);
    group.add(shape.set("fill-opacity", number(opacity)))
}
