//! What was taken for what.

use serde::Serialize;

use crate::clock::Clock;
use crate::rows::{BothRows, Rows};
use crate::scan_walls::TakenScans;

/// What was taken of a topic.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TookTopic {
    /// Its name.
    pub topic: String,
    /// Its type.
    #[serde(rename = "type")]
    pub type_name: String,
    /// Which joints, fields or frames.
    pub what: String,
    /// What wheels' numbers are: ticks, rad, radps, mps, twist; `pose` of an instrument, `radps` of a
    /// gyroscope, `walls` of scans.
    pub quantity: &'static str,
    /// Rows that were taken.
    pub rows: usize,
    /// `header stamps` or `receive times`.
    pub times: &'static str,
}

/// What was taken for what.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Took {
    /// The wheels.
    pub wheels: TookTopic,
    /// The poses, where there are some.
    pub truth: Option<TookTopic>,
    /// The gyroscope, where there is one.
    pub gyro: Option<TookTopic>,
    /// The scans, where walls are taken of them.
    pub scan: Option<TookTopic>,
}

impl Took {
    /// What wheels and poses are, by which clocks, whether the gyroscope was taken, and what was of scans.
    pub(crate) fn of(
        both: &BothRows,
        wheels_what: String,
        truth_what: Option<String>,
        clocks: [Clock; 2],
        has_gyro: bool,
        scans: Option<(&str, TakenScans)>,
    ) -> Self {
        fn topic<T>(rows: &Rows<T>, what: String, quantity: &'static str, clock: Clock) -> TookTopic {
            TookTopic {
                topic: rows.topic.clone(),
                type_name: rows.type_name.clone(),
                what,
                quantity,
                rows: rows.len(),
                times: times(clock),
            }
        }
        let gyro = both.gyro.as_ref().filter(|_| has_gyro).map(|gyro| {
            let frame = if gyro.frame.is_empty() { "an unnamed frame" } else { &gyro.frame };
            let what = format!("angular_velocity.z of {frame}, whose z is taken as up");
            topic(&gyro.rows, what, "radps", clocks[0])
        });
        let scan = scans.map(|(topic, TakenScans { type_name, what, readings })| TookTopic {
            topic: topic.to_owned(),
            type_name,
            what,
            quantity: "walls",
            rows: readings,
            times: times(clocks[0]),
        });
        Self {
            wheels: topic(&both.wheels, wheels_what, both.quantity.name(), clocks[0]),
            truth: both.truth.as_ref().zip(truth_what).map(|(truth, what)| topic(truth, what, "pose", clocks[1])),
            gyro,
            scan,
        }
    }
}

const fn times(clock: Clock) -> &'static str {
    match clock {
        Clock::Stamps => "header stamps",
        Clock::Receipt => "receive times",
    }
}
