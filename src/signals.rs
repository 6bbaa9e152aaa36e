//! Signals that ask the command to end, as Ctrl-C and process managers send them.
//!
//! A command that can be gone on with stops by itself, with what it has so far; any other ends at once, and
//! first takes away what it has begun. A second signal ends both at once.

use std::io::Write;
use std::process::exit;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};

/// The signals of a process.
#[derive(Default)]
pub(crate) struct Signals {
    stop: Arc<AtomicBool>,
    /// The command looks at `stop`.
    stops_early: AtomicBool,
    /// It says that it does.
    tells: AtomicBool,
    /// By convention 128 and the number of the first signal; 0 before there is one.
    exit_code: AtomicU8,
}

impl Signals {
    /// Answers the signals of this process from now on.
    pub(crate) fn answered() -> Arc<Self> {
        let signals = Arc::new(Self::default());
        #[cfg(unix)]
        signals.listen();
        signals
    }

    #[cfg(unix)]
    fn listen(self: &Arc<Self>) {
        use signal_hook::consts::{SIGINT, SIGTERM, SIGXFSZ};
        // A file that grows beyond the limit of the process is then an error of who writes it.
        let _ = signal_hook::flag::register(SIGXFSZ, Arc::default());
        if let Ok(mut received) = signal_hook::iterator::Signals::new([SIGINT, SIGTERM]) {
            let signals = Arc::clone(self);
            std::thread::spawn(move || {
                for signal in &mut received {
                    signals.receive(u8::try_from(128 + signal).unwrap_or(1));
                }
            });
        }
    }

    #[cfg(unix)]
    fn receive(&self, code: u8) {
        let is_first = self.exit_code.compare_exchange(0, code, Ordering::SeqCst, Ordering::SeqCst).is_ok();
        if is_first && self.stops_early.load(Ordering::SeqCst) {
            self.stop.store(true, Ordering::SeqCst);
            if self.tells.load(Ordering::SeqCst) {
                let _ = writeln!(anstream::stderr(), "stopping when what is under way is done; again ends at once");
            }
            return;
        }
        atomic_file::remove_all_under_way();
        exit(code.into());
    }

    /// The flag that the command looks at from now on; unless `quiet` a person is told when it is set.
    pub(crate) fn stop_flag(&self, quiet: bool) -> Arc<AtomicBool> {
        self.tells.store(!quiet, Ordering::SeqCst);
        self.stops_early.store(true, Ordering::SeqCst);
        Arc::clone(&self.stop)
    }

    /// Whether the process is being ended: what the command meets then is of that.
    pub(crate) fn is_ending(&self) -> bool {
        self.exit_code.load(Ordering::SeqCst) != 0 && !self.stops_early.load(Ordering::SeqCst)
    }

    /// The exit code of a command that gave `code`: that of the signal, if one kept it from its end.
    pub(crate) fn exit_code(&self, code: u8) -> u8 {
        match self.exit_code.load(Ordering::SeqCst) {
            0 => code,
            of_signal if code != 0 => of_signal,
            _ => 0,
        }
    }
}
