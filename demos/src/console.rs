//! Text to the person: results on stdout, everything else on stderr.

use std::io::{ErrorKind, Write};
use std::path::Path;

use crate::Error;

/// Prints to stdout. A reader that has gone (`lightloom … | head`) is no failure.
pub(crate) fn print(text: &str) -> Result<(), Error> {
    let mut stdout = std::io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(Error::write(Path::new("stdout"), &error)),
        _ => Ok(()),
    }
}

/// Prints a warning on stderr.
pub(crate) fn warn(text: &str) {
    // Nobody is left to tell when stderr itself is closed.
    let _ = writeln!(std::io::stderr(), "warning: {text}");
}

/// Prints a remark on stderr.
pub(crate) fn note(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Prints an error on stderr.
pub fn report_error(error: &Error) {
    let _ = writeln!(std::io::stderr(), "error: {error}");
}
