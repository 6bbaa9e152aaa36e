//! Which robot a new dataset is of and when it was recorded, where no log says so.

use clap::Args;
use dataset::{Provenance, Timestamp, parse_recorded, parse_robot_id};

/// What `yair fleet` groups and orders sessions by.
#[derive(Args, Default)]
pub(crate) struct SessionIdentity {
    /// Id of the robot: `yair fleet` takes datasets with the same id for sessions of one robot.
    #[arg(long, value_name = "ID", value_parser = parse_robot_id, help_heading = "Session")]
    robot_id: Option<String>,
    /// When the session was recorded, with the offset from UTC (RFC 3339), such as
    /// 2026-11-23T09:00:00+01:00.
    #[arg(long, value_name = "INSTANT", value_parser = parse_recorded, help_heading = "Session")]
    recorded: Option<Timestamp>,
}

impl SessionIdentity {
    /// States what was given; what a log says stays where nothing was.
    pub(crate) fn state_in(&self, provenance: &mut Provenance) {
        if self.robot_id.is_some() {
            provenance.robot_id.clone_from(&self.robot_id);
        }
        provenance.recorded = self.recorded.or(provenance.recorded);
    }
}
