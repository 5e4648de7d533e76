//! How much memory the machine and its container have to spare, and how much this process has used.

use std::fs::read_to_string;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes of memory that the process can take without harm to other programs: what the machine has
/// available, or what a container's limit leaves, if that is less; `None` where the system does not tell.
pub fn available_bytes() -> Option<u64> {
    let machine = read_to_string("/proc/meminfo").ok();
    let machine = machine.and_then(|told| bytes_of_line(&told, "MemAvailable:", 1024));
    let own = read_to_string("/proc/self/cgroup").unwrap_or_default();
    let container = left_above(Path::new("/sys/fs/cgroup"), &own);
    match (machine, container) {
        (Some(machine), Some(container)) => Some(machine.min(container)),
        (machine, container) => machine.or(container),
    }
}

/// Least bytes left by the limits of the group that `/proc/self/cgroup` names and of all groups above it.
fn left_above(root: &Path, own: &str) -> Option<u64> {
    // The line of version 2: `0::/system.slice/fea-server.service`.
    let path = own.lines().find_map(|line| line.strip_prefix("0::/")).unwrap_or_default();
    let group = root.join(path);
    group.ancestors().take_while(|group| group.starts_with(root)).filter_map(left_in).min()
}

/// Bytes left by the limit of a control group (version 2); cached pages of files count as free.
fn left_in(group: &Path) -> Option<u64> {
    let number = |name: &str| read_to_string(group.join(name)).ok()?.trim().parse::<u64>().ok();
    let (max, current) = (number("memory.max")?, number("memory.current")?);
    let stat = read_to_string(group.join("memory.stat")).unwrap_or_default();
    let files = bytes_of_line(&stat, "inactive_file", 1).unwrap_or(0);
    Some(max.saturating_sub(current.saturating_sub(files)))
}

/// Number behind a word at the beginning of a line, in bytes.
fn bytes_of_line(text: &str, word: &str, unit: u64) -> Option<u64> {
    let rest = text.lines().find_map(|line| line.strip_prefix(word))?;
    rest.split_whitespace().next()?.parse::<u64>().ok()?.checked_mul(unit)
}

/// Resident set of this process, bytes; `None` where the system does not tell.
pub(crate) fn resident_bytes() -> Option<u64> {
    let status = read_to_string("/proc/self/status").ok()?;
    bytes_of_line(&status, "VmRSS:", 1024)
}

/// Largest resident set as last read, bytes; reading it takes as long as a small frame question.
static PEAK_RSS: AtomicU64 = AtomicU64::new(0);

/// Largest resident set of this process so far, bytes; 0 where the system does not tell.
pub(crate) fn peak_rss_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let kib = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kib = kib.and_then(|rest| rest.split_whitespace().next()?.parse::<u64>().ok());
    let bytes = kib.unwrap_or(0) * 1024;
    PEAK_RSS.store(bytes, Ordering::Relaxed);
    bytes
}

/// Largest resident set as last read, bytes; accurate enough for an answer that allocates almost nothing.
pub(crate) fn last_peak_rss_bytes() -> u64 {
    PEAK_RSS.load(Ordering::Relaxed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limit_of_a_container_leaves_what_is_not_used_but_by_files() {
        let group = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(group.path().join(name), text).unwrap();
        assert_eq!(left_in(group.path()), None);
        write("memory.max", "max\n");
        write("memory.current", "700\n");
        assert_eq!(left_in(group.path()), None, "no limit");
        write("memory.max", "1000\n");
        assert_eq!(left_in(group.path()), Some(300));
        write("memory.stat", "anon 500\ninactive_file 150\n");
        assert_eq!(left_in(group.path()), Some(450));
    }

    #[test]
    fn limit_of_a_service_counts_and_so_do_those_around_it() {
        let root = tempfile::tempdir().unwrap();
        let service = root.path().join("system.slice/fea-server.service");
        std::fs::create_dir_all(&service).unwrap();
        let write = |folder: &Path, max: &str| {
            std::fs::write(folder.join("memory.max"), max).unwrap();
            std::fs::write(folder.join("memory.current"), "100\n").unwrap();
        };
        let own = "0::/system.slice/fea-server.service\n";
        assert_eq!(left_above(root.path(), own), None);
        write(&service, "1000\n");
        assert_eq!(left_above(root.path(), own), Some(900));
        write(&root.path().join("system.slice"), "400\n");
        assert_eq!(left_above(root.path(), own), Some(300));
        // A container sees its own group as the root.
        write(root.path(), "150\n");
        assert_eq!(left_above(root.path(), "0::/\n"), Some(50));
    }

    #[test]
    fn kibibytes_of_the_machine_become_bytes() {
        let told = "MemTotal: 9 kB\nMemAvailable:    2048 kB\n";
        assert_eq!(bytes_of_line(told, "MemAvailable:", 1024), Some(2 << 20));
    }
}
