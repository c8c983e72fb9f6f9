//! The program, run in this process by `python -m skyway`.

use pyo3::prelude::*;
use std::ffi::OsString;

/// Runs a command until it ends, and gives its exit code; the first argument is the program's own name.
#[pyfunction]
pub(crate) fn run(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| skyway::cli::main_with(arguments))
}
