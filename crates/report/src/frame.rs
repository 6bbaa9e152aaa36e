//! The frame of a panel on paper: where a value stands in it, and its ticks.

use crate::axis::Span;
use crate::font::{Font, Weight};
use crate::ticks::{Tick, ticks};

/// The size of a tick's label.
pub(crate) const TICK_PX: f64 = 12.0;

/// A rectangle on paper, in SVG pixels, y downwards.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Rect {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) w: f64,
    pub(crate) h: f64,
}

impl Rect {
    pub(crate) fn contains(&self, x: f64, y: f64) -> bool {
        (self.x..=self.x + self.w).contains(&x) && (self.y..=self.y + self.h).contains(&y)
    }
}

/// The rectangle that shows data, and which.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    pub(crate) rect: Rect,
    pub(crate) x: Span,
    pub(crate) y: Span,
}

impl Frame {
    pub(crate) fn x_px(&self, value: f64) -> f64 {
        self.rect.x + self.rect.w * self.x.fraction(value)
    }

    pub(crate) fn y_px(&self, value: f64) -> f64 {
        self.rect.y + self.rect.h * (1.0 - self.y.fraction(value))
    }

    pub(crate) fn px(&self, x: f64, y: f64) -> (f64, f64) {
        (self.x_px(x), self.y_px(y))
    }

    pub(crate) fn x_ticks(&self, font: &Font) -> Vec<Tick> {
        let half = |label: &str| font.width_px(label, TICK_PX, Weight::Regular) / 2.0;
        ticks(&self.x, &|a, b, apart| apart * self.rect.w >= (half(a) + half(b) + 14.0).max(46.0))
    }

    pub(crate) fn y_ticks(&self) -> Vec<Tick> {
        ticks(&self.y, &|_, _, apart| apart * self.rect.h >= 2.6 * TICK_PX)
    }
}
