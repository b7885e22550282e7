//! The program `lightloom`; everything but the exit status lives in the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    match lightloom::run(std::env::args_os()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            lightloom::report_error(&error);
            ExitCode::from(error.exit_status())
        }
    }
}
