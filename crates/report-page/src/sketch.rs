//! Manoeuvres as small drawings.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// What is to be driven.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Manoeuvre {
    /// Straight, there and back.
    Straight {
        /// Length, metres.
        length_m: f64,
    },
    /// Circles, both ways round.
    Circle {
        /// Radius, metres.
        radius_m: f64,
    },
    /// Turns on the spot, both ways.
    Spin {
        /// Turn, radians.
        turn_rad: f64,
    },
    /// Squares, both ways round.
    Square {
        /// Side, metres.
        side_m: f64,
    },
    /// A path of straights joined by turns on the spot.
    Polygon {
        /// Length, metres.
        length_m: f64,
    },
}

/// A manoeuvre with what is to be said of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Sketch {
    /// What is driven.
    pub manoeuvre: Manoeuvre,
    /// How often and how fast.
    pub caption: String,
}

impl Sketch {
    /// The name of the drawing.
    pub(crate) fn title(&self) -> String {
        match self.manoeuvre {
            Manoeuvre::Straight { length_m } => format!("Straight, {length_m:.2} m, there and back"),
            Manoeuvre::Circle { radius_m } => format!("Circle of radius {radius_m:.2} m, both ways round"),
            Manoeuvre::Spin { turn_rad } => {
                format!("Turn on the spot by {:.0}°, both ways", turn_rad.to_degrees().abs())
            }
            Manoeuvre::Square { side_m } => format!("Square with sides of {side_m:.2} m, both ways round"),
            Manoeuvre::Polygon { length_m } => format!("Path of {length_m:.1} m with turns on the spot"),
        }
    }

    /// What is in the drawing.
    pub(crate) fn description(&self) -> &'static str {
        match self.manoeuvre {
            Manoeuvre::Straight { .. } => "A straight line with arrows in both directions, the robot at its start.",
            Manoeuvre::Circle { .. } => "A circle with arrows in both directions, the robot at its lowest point.",
            Manoeuvre::Spin { .. } => "The robot with an arrow around it in each direction.",
            Manoeuvre::Square { .. } => "A square with arrows in both directions, the robot at a corner.",
            Manoeuvre::Polygon { .. } => "A line of straight pieces at right angles, the robot at its start.",
        }
    }

    /// Size of the manoeuvre, beside the drawing.
    pub(crate) fn size(&self) -> String {
        match self.manoeuvre {
            Manoeuvre::Straight { length_m } | Manoeuvre::Polygon { length_m } => format!("{length_m:.2} m"),
            Manoeuvre::Circle { radius_m } => format!("r = {radius_m:.2} m"),
            Manoeuvre::Spin { turn_rad } => format!("{:.0}°", turn_rad.to_degrees().abs()),
            Manoeuvre::Square { side_m } => format!("{side_m:.2} m"),
        }
    }

    /// The robot's path in a drawing of 160 by 120, as the data of an SVG path.
    pub(crate) const fn path(&self) -> &'static str {
        match self.manoeuvre {
            Manoeuvre::Straight { .. } => "M24 60 H136",
            Manoeuvre::Circle { .. } => "M80 102 a42 42 0 1 0 0 -84 a42 42 0 1 0 0 84",
            Manoeuvre::Spin { .. } => "M80 26 a34 34 0 1 1 -34 34",
            Manoeuvre::Square { .. } => "M42 98 H118 V22 H42 Z",
            Manoeuvre::Polygon { .. } => "M24 98 H60 V60 H98 V98 H136 V22 H24",
        }
    }

    /// Where the robot stands, x and y in the drawing, and where it looks, degrees clockwise.
    pub(crate) const fn robot(&self) -> (f64, f64, f64) {
        match self.manoeuvre {
            Manoeuvre::Straight { .. } => (24.0, 60.0, 0.0),
            Manoeuvre::Circle { .. } => (80.0, 102.0, 0.0),
            Manoeuvre::Spin { .. } => (80.0, 60.0, -90.0),
            Manoeuvre::Square { .. } => (42.0, 98.0, 0.0),
            Manoeuvre::Polygon { .. } => (24.0, 98.0, 0.0),
        }
    }

    /// Heads of arrows: x, y and direction, degrees clockwise.
    pub(crate) fn arrows(&self) -> Vec<(f64, f64, f64)> {
        match self.manoeuvre {
            Manoeuvre::Straight { .. } => vec![(136.0, 60.0, 0.0), (70.0, 60.0, 180.0)],
            Manoeuvre::Circle { .. } => {
                let on = |angle: f64, turn: f64| {
                    (80.0 + 42.0 * angle.cos(), 60.0 - 42.0 * angle.sin(), -(angle + turn).to_degrees())
                };
                vec![on(FRAC_PI_2 * 0.5, FRAC_PI_2), on(FRAC_PI_2 * 1.5, -FRAC_PI_2)]
            }
            Manoeuvre::Spin { .. } => {
                let on = |angle: f64, turn: f64| {
                    (80.0 + 34.0 * angle.cos(), 60.0 - 34.0 * angle.sin(), -(angle + turn).to_degrees())
                };
                vec![on(PI, -FRAC_PI_2), on(TAU * 0.25, FRAC_PI_2)]
            }
            Manoeuvre::Square { .. } => vec![(118.0, 58.0, -90.0), (42.0, 62.0, -90.0)],
            Manoeuvre::Polygon { .. } => vec![(24.0, 22.0, 180.0)],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drawings_stay_in_their_frame_and_say_their_size() {
        let all = [
            (Manoeuvre::Straight { length_m: 1.5 }, "1.50 m"),
            (Manoeuvre::Circle { radius_m: 0.51 }, "r = 0.51 m"),
            (Manoeuvre::Spin { turn_rad: -TAU }, "360°"),
            (Manoeuvre::Square { side_m: 2.0 }, "2.00 m"),
            (Manoeuvre::Polygon { length_m: 40.0 }, "40.00 m"),
        ];
        for (manoeuvre, size) in all {
            let sketch = Sketch { manoeuvre, caption: String::new() };
            assert_eq!(sketch.size(), size);
            let points = sketch.arrows().into_iter().chain([sketch.robot()]);
            for (x, y, _) in points {
                assert!((20.0..=140.0).contains(&x) && (15.0..=105.0).contains(&y), "{manoeuvre:?} {x} {y}");
            }
            assert!(!sketch.title().is_empty() && !sketch.description().is_empty());
        }
    }
}
