//! The two outside instruments: the paper's floor grid and motion capture.

use dataset::{MarkedPoint, PointReading, Run, TruthSample};
use effects::{Address, Sighting, Stream, StreamName};
use kinematics::{Point, Pose};
use scenario::Instrument;

const READING: StreamName = StreamName::new("instrument reading");

/// An instrument during one run.
#[derive(Debug)]
pub(crate) struct Observer {
    instrument: Instrument,
    stream: Stream,
    samples: u32,
}

impl Observer {
    pub(crate) fn new(instrument: Instrument, position: u64, address: &Address) -> Self {
        Self { instrument, stream: address.stream(READING.nth(position)), samples: 0 }
    }

    /// When the instrument next looks by itself, seconds; the floor grid never does.
    pub(crate) fn next_look_s(&self) -> f64 {
        match self.instrument {
            Instrument::FloorGrid { .. } => f64::INFINITY,
            Instrument::MotionCapture { rate_hz, .. } => f64::from(self.samples) / rate_hz,
        }
    }

    /// A look at the moving robot at [`Self::next_look_s`].
    pub(crate) fn look(&mut self, sighting: Sighting, run: &mut Run) {
        let Instrument::MotionCapture {
            sigma_xy_m,
            sigma_theta_rad,
            latency_s,
            lever_x_m,
            lever_y_m,
            lever_theta_rad,
            ..
        } = self.instrument
        else {
            return;
        };
        self.samples += 1;
        let world_from_marker = sighting.world_from_body * Pose::new(lever_x_m, lever_y_m, lever_theta_rad);
        run.truth.push(TruthSample::new(
            sighting.t_s + latency_s,
            world_from_marker.x_m + sigma_xy_m * self.stream.normal(),
            world_from_marker.y_m + sigma_xy_m * self.stream.normal(),
            Some(world_from_marker.theta_rad + sigma_theta_rad * self.stream.normal()),
        ));
    }

    /// A reading of the standing robot's marks on the floor grid.
    pub(crate) fn read_standing(&mut self, sighting: Sighting, points: &[MarkedPoint], run: &mut Run) {
        let Instrument::FloorGrid { resolution_m, reading_sigma_m } = self.instrument else { return };
        let mut read = |value_m: f64| {
            let read_m = value_m + reading_sigma_m * self.stream.normal();
            if resolution_m > 0.0 { (read_m / resolution_m).round() * resolution_m } else { read_m }
        };
        for (point, mark) in points.iter().enumerate() {
            let room = sighting.world_from_body * mark.body;
            let room = Point::new(read(room.x_m), read(room.y_m));
            run.point_readings.push(PointReading { t_s: sighting.t_s, point, room });
        }
    }
}
