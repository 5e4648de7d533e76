//! Machine, compiler, commit and day of a report.

use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

use crate::threads::processors;

/// Data that a reader needs to judge the figures of a report.
#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    /// Model name of the processor.
    pub cpu: String,
    /// Maker of the processor.
    pub cpu_maker: String,
    /// Number of processors that this process may use.
    pub processors: usize,
    /// Main memory, GiB; 0 where the system does not tell.
    pub memory_gib: f64,
    /// Operating system and kernel.
    pub system: String,
    /// Compiler, and whether it optimised.
    pub compiler: String,
    /// Commit of the working tree; `+ changes` if it differs from it outside `reports/`.
    pub commit: String,
    /// Day when the measurement began, UTC.
    pub date: String,
    /// Load when the measurement began, see [`load_text`].
    pub load_before: String,
}

impl Machine {
    /// Data of this machine; what cannot be determined is "unknown".
    pub fn look() -> Self {
        let cpu_info = read("/proc/cpuinfo");
        let memory_kib = field(&read("/proc/meminfo"), "MemTotal")
            .and_then(|v| v.split(' ').next()?.parse().ok());
        Self {
            cpu: field(&cpu_info, "model name").unwrap_or_else(|| "unknown".to_owned()),
            cpu_maker: maker(field(&cpu_info, "vendor_id").as_deref()),
            processors: processors(),
            memory_gib: memory_kib.map_or(0.0, |kib: f64| kib / f64::from(1 << 20)),
            system: system(),
            compiler: format!("{}, {}", env!("SOFTGRASP_RUSTC"), BUILD),
            commit: commit(),
            date: SystemTime::now()
                .duration_since(UNIX_EPOCH)
                .map_or_else(|_| "unknown".to_owned(), |d| day(d.as_secs() / 86_400)),
            load_before: load_text(),
        }
    }

    /// The data as pairs of name and value, in the order of a report's head.
    pub fn lines(&self) -> Vec<(&'static str, String)> {
        let memory = format!("{:.0} GiB", self.memory_gib);
        vec![
            ("date", self.date.clone()),
            ("commit", self.commit.clone()),
            ("processor", self.cpu.clone()),
            ("processor maker", self.cpu_maker.clone()),
            ("processors", self.processors.to_string()),
            ("memory", if self.memory_gib > 0.0 { memory } else { "unknown".to_owned() }),
            ("system", self.system.clone()),
            ("compiler", self.compiler.clone()),
            ("load before", self.load_before.clone()),
        ]
    }
}

const BUILD: &str = if cfg!(debug_assertions) { "not optimised for measuring" } else { "release" };

/// Average number of processes that were running or waiting in the last minute. Before a measurement they
/// are other work; after it, the measurement's own threads are among them.
pub fn load_text() -> String {
    match read("/proc/loadavg").split_once(' ') {
        Some((load, _)) => load.to_owned(),
        None => "unknown".to_owned(),
    }
}

fn read(path: &str) -> String {
    std::fs::read_to_string(path).unwrap_or_default()
}

/// Value of the first `name : value` line.
fn field(text: &str, name: &str) -> Option<String> {
    let line = text.lines().find(|line| line.starts_with(name))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

/// Plain name of a processor's maker.
fn maker(vendor: Option<&str>) -> String {
    match vendor {
        Some("AuthenticAMD") => "AMD".to_owned(),
        Some("GenuineIntel") => "Intel".to_owned(),
        Some(other) => other.to_owned(),
        None => "unknown".to_owned(),
    }
}

fn system() -> String {
    let release = read("/etc/os-release");
    let name = release.lines().find_map(|line| line.strip_prefix("PRETTY_NAME="));
    let name = name.unwrap_or(std::env::consts::OS).trim_matches('"').to_owned();
    match read("/proc/sys/kernel/osrelease").trim() {
        "" => name,
        kernel => format!("{name}, kernel {kernel}, {}", std::env::consts::ARCH),
    }
}

fn commit() -> String {
    let git = |arguments: &[&str]| {
        let output = Command::new("git").args(arguments).output().ok()?;
        let text = String::from_utf8(output.stdout).ok()?;
        output.status.success().then(|| text.trim().to_owned())
    };
    let Some(head) = git(&["rev-parse", "--short=12", "HEAD"]) else {
        return "unknown".to_owned();
    };
    // The figures themselves are written into `reports/`.
    match git(&["status", "--porcelain", "--", ":/", ":(top,exclude)reports"]) {
        Some(changes) if changes.is_empty() => head,
        _ => format!("{head} + changes"),
    }
}

/// Civil date of a day counted from 1970-01-01, as `YYYY-MM-DD`.
fn day(mut days: u64) -> String {
    let is_leap = |year: u64| {
        year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400))
    };
    let mut year = 1970;
    while days >= 365 + u64::from(is_leap(year)) {
        days -= 365 + u64::from(is_leap(year));
        year += 1;
    }
    let lengths = [31, 28 + u64::from(is_leap(year)), 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    let mut month = 1;
    for length in lengths {
        if days < length {
            break;
        }
        days -= length;
        month += 1;
    }
    format!("{year}-{month:02}-{:02}", days + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_of_leap_years_and_centuries_have_their_dates() {
        assert_eq!(day(0), "1970-01-01");
        assert_eq!(day(59), "1970-03-01");
        assert_eq!(day(10_957), "2000-01-01");
        assert_eq!(day(11_016), "2000-02-29");
        assert_eq!(day(20_453), "2025-12-31");
        // 2100 is no leap year.
        assert_eq!(day(47_540), "2100-02-28");
        assert_eq!(day(47_541), "2100-03-01");
    }

    #[test]
    fn head_names_everything_and_nothing_is_empty() {
        let machine = Machine::look();
        assert!(machine.processors >= 1);
        for (name, value) in machine.lines() {
            assert!(!value.is_empty(), "{name}");
        }
    }

    #[test]
    fn first_line_of_a_name_counts() {
        let text = "processor\t: 0\nmodel name\t: Wonder 9000 @ 3 GHz\nmodel name\t: other\n";
        assert_eq!(field(text, "model name").as_deref(), Some("Wonder 9000 @ 3 GHz"));
        assert_eq!(field(text, "MemTotal"), None);
    }
}
