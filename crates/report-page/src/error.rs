//! Why there is no page.

/// Why a page was not rendered.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PageError {
    /// A template failed.
    #[error("report.html: its template failed: {0}; this is a fault of yair: please report it")]
    Template(#[from] askama::Error),
    /// The page is larger than a mail or an issue takes.
    #[error("report.html: {bytes} bytes are more than {limit}: give fewer datasets")]
    TooLarge {
        /// Size of the page, bytes.
        bytes: usize,
        /// The limit, bytes.
        limit: usize,
    },
}
