//! How much memory there is.

/// Memory that can be had without swapping, bytes.
pub fn available_bytes() -> u64 {
    let mut system = sysinfo::System::new();
    system.refresh_memory();
    system.available_memory()
}
