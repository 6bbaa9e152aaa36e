//! The legend: what it lists, and where it stands without covering data.

use crate::font::{Font, Weight};
use crate::frame::{Frame, Rect};
use crate::marks::{SWATCH_PX, beyond, covered_points};
use crate::panel::Panel;

pub(crate) const TEXT_PX: f64 = 12.0;
pub(crate) const ROW_PX: f64 = 19.0;
const SWATCH_GAP_PX: f64 = 7.0;
const PADDING_PX: f64 = 8.0;
const ENTRY_GAP_PX: f64 = 22.0;
/// Between a legend and the frame, and between a legend and data.
const CLEAR_PX: f64 = 7.0;

/// One name and the series of the panel that bear it.
#[derive(Clone, Debug)]
pub(crate) struct Entry {
    pub(crate) text: String,
    pub(crate) series: Vec<usize>,
    /// The upper left corner, relative to the legend's.
    pub(crate) x: f64,
    pub(crate) y: f64,
}

impl Entry {
    pub(crate) fn text_x(&self) -> f64 {
        self.x + SWATCH_PX + SWATCH_GAP_PX
    }
}

/// A legend with its entries in place.
#[derive(Clone, Debug)]
pub(crate) struct Legend {
    pub(crate) entries: Vec<Entry>,
    pub(crate) width: f64,
    pub(crate) height: f64,
    /// Where inside the frame; below the panel otherwise.
    pub(crate) inside: Option<(f64, f64)>,
}

impl Legend {
    /// The legend of a panel, or none if it shall have none. Inside the frame where no data are; else below,
    /// in rows of at most `room_px`.
    pub(crate) fn of(panel: &Panel, frame: &Frame, font: &Font, room_px: f64) -> Option<Self> {
        let mut entries: Vec<Entry> = Vec::new();
        for (index, series) in panel.series.iter().enumerate().filter(|(_, series)| !series.is_reference()) {
            match entries.iter_mut().find(|entry| entry.text == series.name) {
                Some(entry) => entry.series.push(index),
                None => entries.push(Entry { text: series.name.clone(), series: vec![index], x: 0.0, y: 0.0 }),
            }
        }
        for entry in &mut entries {
            let lost: usize = entry.series.iter().map(|&index| beyond(&panel.series[index], frame)).sum();
            if lost > 0 {
                entry.text = format!("{} ({lost} beyond the axes)", entry.text);
            }
        }
        if !panel.legend || entries.is_empty() {
            return None;
        }
        let widths: Vec<f64> = entries
            .iter()
            .map(|entry| SWATCH_PX + SWATCH_GAP_PX + font.width_px(&entry.text, TEXT_PX, Weight::Regular))
            .collect();
        Some(Self::inside(&entries, &widths, panel, frame).unwrap_or_else(|| below(entries, &widths, room_px)))
    }

    fn inside(entries: &[Entry], widths: &[f64], panel: &Panel, frame: &Frame) -> Option<Self> {
        let width = widths.iter().copied().fold(0.0, f64::max) + 2.0 * PADDING_PX;
        let height = entries.len() as f64 * ROW_PX + PADDING_PX;
        let room = &frame.rect;
        if width > 0.6 * room.w || height > 0.5 * room.h {
            return None;
        }
        let (left, right) = (room.x + CLEAR_PX, room.x + room.w - CLEAR_PX - width);
        let (top, bottom) = (room.y + CLEAR_PX, room.y + room.h - CLEAR_PX - height);
        let (centre, middle) = (f64::midpoint(left, right), f64::midpoint(top, bottom));
        let places = [
            (right, top),
            (left, top),
            (right, bottom),
            (left, bottom),
            (centre, top),
            (centre, bottom),
            (right, middle),
            (left, middle),
        ];
        let covered = covered_points(panel, frame);
        let free = |&&(x, y): &&(f64, f64)| {
            let with_margin =
                Rect { x: x - CLEAR_PX, y: y - CLEAR_PX, w: width + 2.0 * CLEAR_PX, h: height + 2.0 * CLEAR_PX };
            !covered.iter().any(|&point| with_margin.contains(point.0, point.1))
        };
        let place = places.iter().find(free)?;
        let mut entries = entries.to_vec();
        for (row, entry) in entries.iter_mut().enumerate() {
            (entry.x, entry.y) = (PADDING_PX, PADDING_PX / 2.0 + row as f64 * ROW_PX);
        }
        Some(Self { entries, width, height, inside: Some(*place) })
    }
}

fn below(mut entries: Vec<Entry>, widths: &[f64], room_px: f64) -> Legend {
    let (mut x, mut y, mut widest) = (0.0, 0.0, 0.0_f64);
    for (entry, width) in entries.iter_mut().zip(widths) {
        if x > 0.0 && x + width > room_px {
            (x, y) = (0.0, y + ROW_PX);
        }
        (entry.x, entry.y) = (x, y);
        widest = widest.max(x + width);
        x += width + ENTRY_GAP_PX;
    }
    Legend { entries, width: widest.min(room_px), height: y + ROW_PX, inside: None }
}
