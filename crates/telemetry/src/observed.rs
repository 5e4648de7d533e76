//! What metrics tell: values that are read with each export, and the ranges of durations.

/// Upper ends of the ranges in which the durations of requests are counted, s.
pub const DURATION_BOUNDS_S: [f64; 12] =
    [0.0001, 0.00025, 0.0005, 0.001, 0.0025, 0.005, 0.01, 0.016, 0.05, 0.25, 1.0, 10.0];

/// A value that changes, and how it is read.
pub struct Observed {
    /// Name of the metric, as `softgrasp.server.sessions`.
    pub name: &'static str,
    /// Unit by UCUM, as `By`, or `{session}` for a count.
    pub unit: &'static str,
    /// What the value is, in one line.
    pub description: &'static str,
    /// Present value; `None` where there is none any more.
    pub read: Box<dyn Fn() -> Option<f64> + Send + Sync>,
}
