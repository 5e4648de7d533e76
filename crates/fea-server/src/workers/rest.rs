//! Pauses for work that must keep neither a pool nor a core from the frames.

use std::time::Instant;

/// Lets a thread rest so that it works for a tenth of its time, in pieces far shorter than the
/// slices in which a system hands out its cores: nothing that is urgent ever waits for it.
pub(crate) struct Rest {
    worked_since: Instant,
}

/// Time at rest per time at work.
const REST_PER_WORK: u32 = 9;

impl Rest {
    /// Work begins.
    pub fn new() -> Self {
        Self { worked_since: Instant::now() }
    }

    /// Rests for what has been worked since the last rest.
    pub fn rest(&mut self) {
        std::thread::sleep(REST_PER_WORK * self.worked_since.elapsed());
        self.worked_since = Instant::now();
    }
}
