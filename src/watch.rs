//! What another thread may see of a command under way, and how it stops it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use indicatif::ProgressBar;

/// Looks at a command under way from another thread.
#[derive(Debug, Default)]
pub struct Watch {
    stop: Arc<AtomicBool>,
    stops_early: AtomicBool,
    bar: Mutex<Option<ProgressBar>>,
}

/// How far a command has come.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Progress {
    /// What is counted.
    pub what: String,
    /// So many are done.
    pub done: u64,
    /// So many there will be.
    pub total: u64,
}

impl Watch {
    /// Asks the command to stop. Those that can ([`Self::stops_early`]) leave what can be gone on with.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// Whether the command under way looks at [`Self::stop`]; one that does not ends when it is done.
    #[must_use]
    pub fn stops_early(&self) -> bool {
        self.stops_early.load(Ordering::Relaxed)
    }

    /// How far the command has come, where it counts.
    #[must_use]
    pub fn progress(&self) -> Option<Progress> {
        let bar = self.bar.lock().unwrap_or_else(PoisonError::into_inner);
        let bar = bar.as_ref()?;
        Some(Progress { what: bar.message(), done: bar.position(), total: bar.length()? })
    }

    /// The flag that the command looks at.
    pub(crate) fn stop_flag(&self) -> Arc<AtomicBool> {
        self.stops_early.store(true, Ordering::Relaxed);
        Arc::clone(&self.stop)
    }

    pub(crate) fn follow(&self, bar: &ProgressBar) {
        *self.bar.lock().unwrap_or_else(PoisonError::into_inner) = Some(bar.clone());
    }
}
