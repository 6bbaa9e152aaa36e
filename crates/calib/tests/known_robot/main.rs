//! Methods on logs of a robot whose wheels and wheelbase are known.

mod exact;
mod golden;
mod log;
mod scatter;
