//! Values that are read each time metrics are exported.

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
