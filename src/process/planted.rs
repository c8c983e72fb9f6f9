//! Which bug is planted in this process; see [`crate::planted`].

use std::io;

/// Plants the bug that `SKYWAY_PLANTED_BUG` names. Without the feature of bugs there is none to plant.
///
/// # Errors
/// When there is no bug of this name.
#[cfg(not(feature = "planted"))]
pub(super) fn plant_bug() -> io::Result<()> {
    Ok(())
}

/// Plants the bug that `SKYWAY_PLANTED_BUG` names.
///
/// # Errors
/// When there is no bug of this name.
#[cfg(feature = "planted")]
#[expect(
    clippy::disallowed_methods,
    reason = "the door of tests to a planted bug"
)]
pub(super) fn plant_bug() -> io::Result<()> {
    let Ok(name) = std::env::var("SKYWAY_PLANTED_BUG") else {
        return Ok(());
    };
    let bug = name.parse().map_err(io::Error::other)?;
    tracing::warn!(name, "this process has a planted bug");
    crate::planted::plant(bug);
    if std::env::var_os("SKYWAY_PLANTED_UNCHECKED").is_some() {
        crate::planted::leave_unchecked();
    }
    Ok(())
}
