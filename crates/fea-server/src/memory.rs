//! How much memory the machine has to spare.

/// Bytes that can be had without ending somebody's program; `None` where the system does not tell.
pub(crate) fn available_bytes() -> Option<u64> {
    let told = std::fs::read_to_string("/proc/meminfo").ok()?;
    let kib = told.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    Some(kib.split_whitespace().next()?.parse::<u64>().ok()? * 1024)
}
