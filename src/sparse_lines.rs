//! Progress where no terminal is: a line now and then, for the logs of servers and CI.

use std::fmt;
use std::io::{self, Write as _};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::TermLike;

/// Nothing is said of what ends before.
const FIRST_AFTER: Duration = Duration::from_secs(2);

/// Times between two lines: each is so many times the one before, so that a day makes a page and no book.
const GROWTH: f64 = 1.5;

/// What `indicatif` takes for a terminal: of all that it draws a line is written now and then.
pub(crate) struct SparseLines {
    state: Mutex<State>,
}

struct State {
    drawn: String,
    next: Instant,
    pause: Duration,
}

impl SparseLines {
    pub(crate) fn new() -> Self {
        let state = State { drawn: String::new(), next: Instant::now() + FIRST_AFTER, pause: FIRST_AFTER };
        Self { state: Mutex::new(state) }
    }

    /// Adds to what is drawn; a thread that has panicked loses a line.
    fn draw(&self, text: &str) {
        if let Ok(mut state) = self.state.lock() {
            state.drawn.push_str(text);
        }
    }
}

impl fmt::Debug for SparseLines {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("SparseLines")
    }
}

impl TermLike for SparseLines {
    fn width(&self) -> u16 {
        100
    }

    fn move_cursor_up(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn move_cursor_down(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn move_cursor_right(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn move_cursor_left(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn write_line(&self, text: &str) -> io::Result<()> {
        self.draw(text);
        Ok(())
    }

    fn write_str(&self, text: &str) -> io::Result<()> {
        self.draw(text);
        Ok(())
    }

    fn clear_line(&self) -> io::Result<()> {
        Ok(())
    }

    fn flush(&self) -> io::Result<()> {
        let Ok(mut state) = self.state.lock() else { return Ok(()) };
        let line = std::mem::take(&mut state.drawn);
        let now = Instant::now();
        if now < state.next || line.trim().is_empty() {
            return Ok(());
        }
        state.pause = state.pause.mul_f64(GROWTH);
        state.next = now + state.pause;
        writeln!(io::stderr(), "{}", line.trim_end())
    }
}
