//! Counters of the server's work, as text for Prometheus.
//!
//! Format: the text exposition format 0.0.4 (prometheus.io, "Exposition formats").

use std::fmt::Write;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::Duration;

use softgrasp_protocol::{Kind, RejectCode};
use softgrasp_telemetry::DURATION_BOUNDS_S as BOUNDS_S;

use crate::tokens::TokenNumbers;

/// Counters of one server; their values only grow.
#[derive(Default)]
pub(crate) struct Metrics {
    sessions: AtomicU64,
    turned_away: AtomicU64,
    not_introduced: AtomicU64,
    given_up: AtomicU64,
    abandoned: AtomicU64,
    bytes_received: AtomicU64,
    bytes_sent: AtomicU64,
    /// Durations of requests by kind, in the order of [`Kind::ALL`].
    requests: [Durations; Kind::ALL.len()],
    /// Durations of frame questions, which are not among those of [`Kind::Ask`].
    frames: Durations,
    /// Number of refusals by code, in the order of [`RejectCode::ALL`].
    refused: [AtomicU64; RejectCode::ALL.len()],
}

/// Distribution of the times from the last byte of a request to its reply.
#[derive(Default)]
struct Durations {
    /// Number of durations in each range of [`BOUNDS_S`], and above all of them.
    counts: [AtomicU64; BOUNDS_S.len() + 1],
    sum_us: AtomicU64,
}

/// Values that are read when the page is asked for.
pub(crate) struct Gauges {
    /// Number of sessions.
    pub sessions: usize,
    /// Number of connections that have not introduced themselves.
    pub strangers: usize,
    /// Number of requests that wait or are worked on.
    pub queued: usize,
    /// Number of kept models.
    pub models: usize,
    /// Memory of the kept models, with factors, columns and contact sets, bytes.
    pub models_bytes: u64,
    /// Memory reserved for requests under way, bytes.
    pub reserved_bytes: u64,
    /// Limit of both together, bytes.
    pub limit_bytes: u64,
    /// Resident set of the process, bytes; `None` where the system does not tell.
    pub resident_bytes: Option<u64>,
    /// Whether the server accepts new sessions.
    pub is_ready: bool,
    /// Last second of the certificate's validity, as Unix time, s; `None` without encryption.
    pub certificate_expires_s: Option<i64>,
    /// Sessions and requests counted for each token that has a name.
    pub tokens: Vec<TokenNumbers>,
}

impl Metrics {
    /// Counts a session that has begun.
    pub fn session_began(&self) {
        self.sessions.fetch_add(1, Relaxed);
    }

    /// Counts a connection that ended before it had introduced itself.
    pub fn not_introduced(&self) {
        self.not_introduced.fetch_add(1, Relaxed);
    }

    /// Counts a client that was turned away because all places were taken.
    pub fn turned_away(&self) {
        self.turned_away.fetch_add(1, Relaxed);
    }

    /// Counts a session that was given up: bad bytes, too slow, or broken.
    pub fn given_up(&self) {
        self.given_up.fetch_add(1, Relaxed);
    }

    /// Counts a request whose client has gone.
    pub fn abandoned(&self) {
        self.abandoned.fetch_add(1, Relaxed);
    }

    /// Counts a whole request of `bytes` bytes.
    pub fn received(&self, bytes: usize) {
        self.bytes_received.fetch_add(bytes as u64, Relaxed);
    }

    /// Counts a reply of `bytes` bytes that was written.
    pub fn sent(&self, bytes: usize) {
        self.bytes_sent.fetch_add(bytes as u64, Relaxed);
    }

    /// Counts a request that was answered, or refused with a code; `is_frame` for a frame question.
    pub fn answered(
        &self,
        (kind, is_frame): (Option<Kind>, bool),
        took: Duration,
        refused: Option<RejectCode>,
    ) {
        let place = kind.and_then(|kind| Kind::ALL.iter().position(|known| *known == kind));
        let of_kind = place.and_then(|place| self.requests.get(place));
        if let Some(durations) = if is_frame { Some(&self.frames) } else { of_kind } {
            durations.add(took);
        }
        let code = refused.and_then(|code| RejectCode::ALL.iter().position(|c| *c == code));
        if let Some(count) = code.and_then(|place| self.refused.get(place)) {
            count.fetch_add(1, Relaxed);
        }
    }

    /// Text of the page: counters and gauges.
    pub fn text(&self, gauges: &Gauges) -> String {
        let mut page = Page(String::new());
        self.write_counters(&mut page);
        self.write_requests(&mut page);
        gauges.write(&mut page);
        page.0
    }

    fn write_counters(&self, page: &mut Page) {
        let counters = [
            ("sessions_total", "Sessions that have begun.", &self.sessions),
            ("turned_away_total", "Clients for which there was no place.", &self.turned_away),
            (
                "not_introduced_total",
                "Connections that ended before they had introduced themselves.",
                &self.not_introduced,
            ),
            ("given_up_total", "Sessions that were given up.", &self.given_up),
            ("abandoned_total", "Requests whose client has gone.", &self.abandoned),
            ("received_bytes_total", "Bytes of whole requests.", &self.bytes_received),
            ("sent_bytes_total", "Bytes of replies.", &self.bytes_sent),
        ];
        for (name, help, count) in counters {
            page.begin(name, "counter", help);
            page.line(name, "", count.load(Relaxed));
        }
        let name = "refused_total";
        page.begin(name, "counter", "Requests that were refused, by code.");
        for (code, count) in RejectCode::ALL.iter().zip(&self.refused) {
            page.line(name, &format!("{{code=\"{code}\"}}"), count.load(Relaxed));
        }
    }

    fn write_requests(&self, page: &mut Page) {
        let name = "request_seconds";
        page.begin(name, "histogram", "From the last byte of a request to its reply.");
        for (kind, durations) in Kind::ALL.iter().zip(&self.requests) {
            // The kinds of replies are never asked.
            if *kind as u16 & 0x8000 == 0 {
                durations.write(page, name, &kind.to_string());
            }
        }
        self.frames.write(page, name, "Frame");
    }
}

impl Durations {
    fn add(&self, took: Duration) {
        let place = BOUNDS_S.partition_point(|bound| *bound < took.as_secs_f64());
        if let Some(count) = self.counts.get(place) {
            count.fetch_add(1, Relaxed);
        }
        self.sum_us.fetch_add(u64::try_from(took.as_micros()).unwrap_or(u64::MAX), Relaxed);
    }

    fn write(&self, page: &mut Page, name: &str, kind: &str) {
        let mut sum = 0;
        let bounds = BOUNDS_S.iter().map(f64::to_string).chain(["+Inf".to_owned()]);
        for (count, bound) in self.counts.iter().zip(bounds) {
            sum += count.load(Relaxed);
            let labels = format!("{{kind=\"{kind}\",le=\"{bound}\"}}");
            page.line(&format!("{name}_bucket"), &labels, sum);
        }
        let labels = format!("{{kind=\"{kind}\"}}");
        let seconds = self.sum_us.load(Relaxed) as f64 * 1e-6;
        page.line(&format!("{name}_sum"), &labels, seconds);
        page.line(&format!("{name}_count"), &labels, sum);
    }
}

impl Gauges {
    fn write(&self, page: &mut Page) {
        let gauges = [
            ("sessions", "Sessions that are there.", self.sessions as u64),
            (
                "strangers",
                "Connections that have not introduced themselves.",
                self.strangers as u64,
            ),
            ("queued_requests", "Requests that wait or are worked on.", self.queued as u64),
            ("models", "Models that are kept.", self.models as u64),
            ("models_bytes", "Memory of the models and what is made for them.", self.models_bytes),
            ("reserved_bytes", "Memory reserved for requests under way.", self.reserved_bytes),
            ("memory_limit_bytes", "Memory for both together.", self.limit_bytes),
            ("ready", "1 if new sessions are taken.", u64::from(self.is_ready)),
        ];
        for (name, help, value) in gauges {
            page.begin(name, "gauge", help);
            page.line(name, "", value);
        }
        if let Some(seconds) = self.certificate_expires_s {
            let name = "certificate_expires_seconds";
            page.begin(name, "gauge", "End of the certificate's life, as Unix time.");
            page.line(name, "", seconds);
        }
        self.write_tokens(page);
        if let Some(bytes) = self.resident_bytes {
            // The name that all programs use for it.
            let _ = writeln!(page.0, "# HELP process_resident_memory_bytes Resident memory.");
            let _ = writeln!(page.0, "# TYPE process_resident_memory_bytes gauge");
            let _ = writeln!(page.0, "process_resident_memory_bytes {bytes}");
        }
    }
}

impl Gauges {
    fn write_tokens(&self, page: &mut Page) {
        type Number = fn(&TokenNumbers) -> u64;
        let numbers: [(&str, &str, &str, Number); 4] = [
            ("sessions", "gauge", "Sessions that are there, by token.", |token| token.sessions),
            ("sessions_total", "counter", "Sessions that have begun, by token.", |token| {
                token.sessions_total
            }),
            (
                "requests_total",
                "counter",
                "Requests with an answer or a refusal, by token.",
                |token| token.requests,
            ),
            ("refused_total", "counter", "Requests that were refused, by token.", |token| {
                token.refused
            }),
        ];
        for (name, kind, help, number) in numbers {
            if self.tokens.is_empty() {
                continue;
            }
            let name = format!("token_{name}");
            page.begin(&name, kind, help);
            for token in &self.tokens {
                page.line(&name, &format!("{{token=\"{}\"}}", token.name), number(token));
            }
        }
    }
}

/// Text of the page while it is being written; writing to it never fails.
struct Page(String);

impl Page {
    fn begin(&mut self, name: &str, kind: &str, help: &str) {
        let _ = writeln!(self.0, "# HELP softgrasp_{name} {help}");
        let _ = writeln!(self.0, "# TYPE softgrasp_{name} {kind}");
    }

    fn line(&mut self, name: &str, labels: &str, value: impl std::fmt::Display) {
        let _ = writeln!(self.0, "softgrasp_{name}{labels} {value}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GAUGES: Gauges = Gauges {
        sessions: 3,
        strangers: 4,
        queued: 1,
        models: 2,
        models_bytes: 10,
        reserved_bytes: 5,
        limit_bytes: 100,
        resident_bytes: Some(7),
        is_ready: true,
        certificate_expires_s: Some(2_000_000_000),
        tokens: Vec::new(),
    };

    fn value(text: &str, name: &str) -> f64 {
        let line = text.lines().find(|line| line.rsplit_once(' ').is_some_and(|(n, _)| n == name));
        line.unwrap_or_else(|| panic!("no {name}")).rsplit_once(' ').unwrap().1.parse().unwrap()
    }

    #[test]
    fn every_line_is_a_comment_or_a_name_and_a_number() {
        let text = Metrics::default().text(&GAUGES);
        for line in text.lines() {
            let is_comment = line.starts_with("# HELP ") || line.starts_with("# TYPE ");
            let number = line.rsplit_once(' ').and_then(|(_, value)| value.parse::<f64>().ok());
            assert!(is_comment || number.is_some(), "{line}");
        }
        assert!(text.ends_with('\n'));
    }

    #[test]
    fn requests_are_counted_by_kind_in_ranges_that_add_up() {
        let metrics = Metrics::default();
        metrics.answered((Some(Kind::Ask), true), Duration::from_micros(100), None);
        metrics.answered((Some(Kind::Ask), true), Duration::from_micros(101), None);
        metrics.answered((Some(Kind::Ask), true), Duration::from_secs(60), Some(RejectCode::Busy));
        metrics.answered((None, false), Duration::ZERO, Some(RejectCode::BadRequest));
        let text = metrics.text(&GAUGES);
        let of = |le| {
            value(&text, &format!("softgrasp_request_seconds_bucket{{kind=\"Frame\",le=\"{le}\"}}"))
        };
        assert_eq!((of("0.0001"), of("0.00025"), of("10"), of("+Inf")), (1.0, 2.0, 2.0, 3.0));
        assert_eq!(value(&text, "softgrasp_request_seconds_count{kind=\"Frame\"}"), 3.0);
        assert_eq!(value(&text, "softgrasp_request_seconds_count{kind=\"Ask\"}"), 0.0);
        assert_eq!(value(&text, "softgrasp_request_seconds_count{kind=\"Ping\"}"), 0.0);
        let sum = value(&text, "softgrasp_request_seconds_sum{kind=\"Frame\"}");
        assert!((sum - 60.000201).abs() < 1e-9);
        let refused: f64 = text
            .lines()
            .filter(|line| line.starts_with("softgrasp_refused_total{"))
            .map(|line| line.rsplit_once(' ').unwrap().1.parse::<f64>().unwrap())
            .sum();
        assert_eq!(refused, 2.0);
        assert_eq!(value(&text, "softgrasp_sessions"), 3.0);
        assert_eq!(value(&text, "process_resident_memory_bytes"), 7.0);
    }
}
