//! The paper: its protocol gives its robot back, its tables come out, and its trial does the work of a bare
//! loop.

mod bare_loop;
mod calibration;
mod reproduction;
#[path = "../../benches/yardstick/mod.rs"]
mod yardstick;
