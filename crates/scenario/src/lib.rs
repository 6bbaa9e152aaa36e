//! The words of an experiment as data: TOML in and out, no behaviour.
mod robot;
pub use robot::{ControlMode, Controller, Encoder, Mark, Motor, QUADRATURE_DECODING, Robot};
