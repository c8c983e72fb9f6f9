//! The engine and the program of Skyway as a module of Python, under the package `skyway` that wraps it.
//!
//! This is the one crate beside `skyway-pack-c` that brings unsafe code: what the macros of PyO3 write. There is none of its own.
//! A fault of the engine becomes an exception; nothing ends the process.

mod answer;
mod composed;
mod core;
mod document;
mod flown;
mod ground;
mod many;
mod picture;
#[cfg(feature = "program")]
mod program;
mod question;
mod refusal;
mod world;

use pyo3::prelude::*;

/// What `skyway` is made of; nothing for callers.
#[pymodule]
mod _skyway {
    #[pymodule_export]
    use crate::answer::Answer;
    #[pymodule_export]
    use crate::composed::ShortestPlan;
    #[pymodule_export]
    use crate::core::Core;
    #[pymodule_export]
    use crate::flown::Plan;
    #[cfg(feature = "program")]
    #[pymodule_export]
    use crate::program::run;
    #[pymodule_export]
    use crate::world::{World, bundled, generate, load};
}
