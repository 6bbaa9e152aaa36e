//! `yair._yair`: the command and its datasets for Python. What a Python user meets is in `package/yair/`;
//! here is what only Rust can do: running the command without the interpreter's lock, and columns from and to
//! numpy.
// PyO3 hands values over.
#![allow(clippy::needless_pass_by_value)]

mod columns;

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use yair::command::{self, Call, Watch};

/// Time between two checks of Ctrl-C and of the progress. A command that ends is heard at once.
const BETWEEN_LOOKS: Duration = Duration::from_millis(50);

/// Stack of the thread that runs a command, bytes: that of a process' main thread on Linux, as the command
/// has it.
const STACK_BYTES: usize = 8 << 20;

/// Exit code, JSON document, remarks, message of the failure.
type Answer = (u8, Option<String>, Vec<String>, Option<String>);

/// Runs the command with these arguments, the program's name first, and prints nothing.
///
/// Other Python threads run meanwhile. `progress(what, done, total)` is called now and then. Ctrl-C raises
/// KeyboardInterrupt: a sweep is stopped and has written its state by then, anything else goes on unheard.
#[pyfunction]
#[pyo3(signature = (arguments, progress=None))]
fn call(py: Python<'_>, arguments: Vec<OsString>, progress: Option<Bound<'_, PyAny>>) -> PyResult<Answer> {
    let watch = Arc::new(Watch::default());
    let (sender, receiver) = channel();
    let watched = Arc::clone(&watch);
    std::thread::Builder::new().name("yair".to_owned()).stack_size(STACK_BYTES).spawn(move || {
        // Nobody listens any more after Ctrl-C.
        let _ = sender.send(command::call(arguments, &watched));
    })?;
    // A receiver may be used by one thread at a time, which the compiler cannot see of a closure.
    let receiver = Mutex::new(receiver);
    let hear = |patience: Duration| receiver.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(patience);
    let mut told = None;
    loop {
        match py.detach(|| hear(BETWEEN_LOOKS)) {
            Ok(Call { exit_code, document, remarks, failure }) => return Ok((exit_code, document, remarks, failure)),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err("yair panicked, which is an error of its own; please report it"));
            }
        }
        let mut look = || {
            py.check_signals()?;
            match (&progress, watch.progress()) {
                (Some(progress), Some(now)) if told.as_ref() != Some(&now) => {
                    progress.call1((&now.what, now.done, now.total))?;
                    told = Some(now);
                }
                _ => {}
            }
            Ok(())
        };
        if let Err(interrupt) = look() {
            watch.stop();
            while watch.stops_early() && py.detach(|| hear(BETWEEN_LOOKS)) == Err(RecvTimeoutError::Timeout) {
                // A second Ctrl-C waits for nothing.
                py.check_signals()?;
            }
            return Err(interrupt);
        }
    }
}

/// Runs the command as a process does, on its standard output, and returns the exit code.
#[pyfunction]
fn main(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| command::main(arguments))
}

/// Datasets in or below these folders of which the folder `out` of a fleet keeps no result.
#[pyfunction]
fn datasets_to_compute(
    py: Python<'_>,
    dirs: Vec<PathBuf>,
    out: PathBuf,
    calibrate_only: bool,
) -> PyResult<Vec<PathBuf>> {
    py.detach(|| yair::datasets_to_compute(&dirs, &out, calibrate_only)).map_err(PyValueError::new_err)
}

/// The Rust half of the package.
#[pymodule]
fn _yair(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<columns::Columns>()?;
    module.add_function(wrap_pyfunction!(call, module)?)?;
    module.add_function(wrap_pyfunction!(datasets_to_compute, module)?)?;
    module.add_function(wrap_pyfunction!(main, module)?)
}
