//! The examples of the crates' READMEs, compiled and run as doc tests of this crate: one program for all of
//! them, where each crate's own would be linked by itself. They are in no package of `yair`, which holds no
//! other crate's files.

#[doc = include_str!("../crates/atomic-file/README.md")]
pub struct AtomicFile;

#[doc = include_str!("../crates/bench/README.md")]
pub struct Bench;

#[doc = include_str!("../crates/blind-benchmark/README.md")]
pub struct BlindBenchmark;

#[doc = include_str!("../crates/calib/README.md")]
pub struct Calib;

#[doc = include_str!("../crates/dataset/README.md")]
pub struct Dataset;

#[doc = include_str!("../crates/diagnose/README.md")]
pub struct Diagnose;

#[doc = include_str!("../crates/effects/README.md")]
pub struct Effects;

#[doc = include_str!("../crates/estimation/README.md")]
pub struct Estimation;

#[doc = include_str!("../crates/export/README.md")]
pub struct Export;

#[doc = include_str!("../crates/fleet/README.md")]
pub struct Fleet;

#[doc = include_str!("../crates/kinematics/README.md")]
pub struct Kinematics;

#[doc = include_str!("../crates/model-term/README.md")]
pub struct ModelTerm;

#[doc = include_str!("../crates/motion-programs/README.md")]
pub struct MotionPrograms;

#[doc = include_str!("../crates/paper-reproduction/README.md")]
pub struct PaperReproduction;

#[doc = include_str!("../crates/preflight/README.md")]
pub struct Preflight;

#[doc = include_str!("../crates/report/README.md")]
pub struct Report;

#[doc = include_str!("../crates/report-page/README.md")]
pub struct ReportPage;

#[doc = include_str!("../crates/robot-files/README.md")]
pub struct RobotFiles;

#[doc = include_str!("../crates/ros-bag/README.md")]
pub struct RosBag;

#[doc = include_str!("../crates/rules/README.md")]
pub struct Rules;

#[doc = include_str!("../crates/scenario/README.md")]
pub struct Scenario;

#[doc = include_str!("../crates/sim-yair/README.md")]
pub struct SimYair;

#[doc = include_str!("../crates/plain-robot/README.md")]
pub struct PlainRobot;

#[doc = include_str!("../crates/replay/README.md")]
pub struct Replay;

#[doc = include_str!("../crates/speed-gate/README.md")]
pub struct SpeedGate;
