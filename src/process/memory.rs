//! What a daemon asks of the system's memory.

/// No transparent huge pages for this process, for as long as it lives.
///
/// The allocator's memory would come in pages of 2 MiB, each zeroed when it is first touched: where the machine is a virtual
/// one that has to find the memory first, a request that touches one waits for milliseconds, and nothing interrupts that.
/// Pages of 4 KiB may cost more in all, never so much at once. docs/results/load.md has the measurement.
#[cfg(target_os = "linux")]
pub fn without_huge_pages() {
    if let Err(error) = rustix::thread::disable_transparent_huge_pages(true) {
        tracing::warn!(%error, "memory may come in huge pages, and requests wait for them");
    }
}

/// Other systems hand out no huge pages by themselves.
#[cfg(not(target_os = "linux"))]
pub fn without_huge_pages() {}
