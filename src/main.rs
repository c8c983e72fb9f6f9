//! The one binary; its first argument chooses what it does.

use std::process::ExitCode;

// Every answer is many small pieces that live as long as its record; this allocator is at home with that.
#[cfg(feature = "edge")]
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    ExitCode::from(skyway::cli::main())
}
