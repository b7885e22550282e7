//! A progress line on stderr when that is a terminal; nothing otherwise.

use std::fmt;

use indicatif::{ProgressBar, ProgressStyle};

/// One line that fills as work is done and disappears when dropped.
pub(crate) struct ProgressLine {
    bar: ProgressBar,
}

impl ProgressLine {
    /// A line that begins with `label`, such as a strategy's name.
    pub(crate) fn new(label: &str) -> Self {
        // indicatif draws on stderr, and hides itself where that is no terminal.
        let bar = ProgressBar::new(1);
        if let Ok(style) = ProgressStyle::with_template("{prefix:>14} [{bar:32}] {percent:>3} % {elapsed:>4} {wide_msg}") {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.set_prefix(label.to_owned());
        Self { bar }
    }

    /// Shows that `done` of `total` steps are behind us, and what runs now.
    pub(crate) fn update(&self, done: u64, total: u64, message: &str) {
        self.bar.set_length(total);
        self.bar.set_position(done);
        if self.bar.message() != message {
            self.bar.set_message(message.to_owned());
        }
    }
}

impl Drop for ProgressLine {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

impl fmt::Debug for ProgressLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ProgressLine").finish_non_exhaustive()
    }
}
