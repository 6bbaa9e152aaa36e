//! The command as a user runs it: what scripts rely on, bad input, sessions compared, campaigns that are
//! stopped, and the gate on accuracy.

mod accuracy_gate;
mod bad_input;
mod compare;
mod contract;
#[path = "../support/mod.rs"]
mod support;
mod sweep_campaign;
