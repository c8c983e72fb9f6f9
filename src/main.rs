//! The one binary; its first argument chooses what it does.

use std::process::ExitCode;

fn main() -> ExitCode {
    skyway::cli::main()
}
