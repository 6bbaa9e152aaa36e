//! Methods on logs of a robot whose wheels and wheelbase are known.

mod along;
mod exact;
mod golden;
#[path = "../../../estimation/src/tests/golden_numbers.rs"]
mod golden_numbers;
mod log;
mod partial;
mod report;
mod scatter;
