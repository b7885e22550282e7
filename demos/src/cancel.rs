//! Ctrl-C: the work in hand stops at the next pass, and the program ends without half-written files.

use std::ops::ControlFlow;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::Error;

static INTERRUPTED: AtomicBool = AtomicBool::new(false);
static INSTALL: Once = Once::new();

/// Starts to listen for Ctrl-C. The first press asks the work to stop; a second one ends the program at once.
pub(crate) fn listen() {
    INSTALL.call_once(|| {
        let handler = || {
            if INTERRUPTED.swap(true, Ordering::Relaxed) {
                std::process::exit(1);
            }
        };
        if let Err(error) = ctrlc::set_handler(handler) {
            crate::console::warn(&format!("Ctrl-C ends the program abruptly here, since no handler could be set: {error}"));
        }
    });
}

/// `Break` once Ctrl-C was pressed: what an observer of long work answers.
pub(crate) fn flow() -> ControlFlow<()> {
    if INTERRUPTED.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
}

/// An error once Ctrl-C was pressed; called between steps.
pub(crate) fn check() -> Result<(), Error> {
    if flow().is_break() {
        return Err(Error::Interrupted);
    }
    Ok(())
}
