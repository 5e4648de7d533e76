//! How often pictures are drawn.

use std::time::{Duration, Instant};

use super::graphics::Graphics;

/// Says when the next picture is due.
pub struct DrawingPace {
    last: Instant,
    /// Pictures a second, smoothed.
    fps: f64,
    /// Shortest time between two pictures.
    every: Duration,
    begun: Instant,
    pictures: u64,
}

/// Shortest time between two pictures where the processor draws: the solver needs it too.
const EVERY_BY_SOFTWARE: Duration = Duration::from_millis(66);
/// Shortest time between two pictures that nobody sees, or that are the same.
const EVERY_STILL: Duration = Duration::from_millis(250);
/// Shortest time between two pictures on a graphics card; it waits for its display by itself, if that
/// does.
const EVERY: Duration = Duration::from_millis(4);

impl DrawingPace {
    /// The pace that suits what draws.
    pub fn of(graphics: &Graphics) -> Self {
        let every = if graphics.is_software { EVERY_BY_SOFTWARE } else { EVERY };
        let now = Instant::now();
        Self { last: now, fps: 0.0, every, begun: now, pictures: 0 }
    }

    /// Waits until the next picture is due; longer where nothing changes in it.
    pub fn rest(&mut self, is_still: bool) {
        let took = self.last.elapsed();
        let every = if is_still { EVERY_STILL } else { self.every };
        std::thread::sleep(every.saturating_sub(took));
        let period = self.last.elapsed().as_secs_f64().max(1e-6);
        self.fps += 0.1 * (1.0 / period - self.fps);
        self.last = Instant::now();
        self.pictures += 1;
        // For those who drive the window by a program: what they did before is seen now.
        tracing::debug!(target: "softgrasp_window::places", picture = self.pictures);
    }

    /// Writes into the log how many pictures were drawn.
    pub fn tell(&self) {
        let seconds = self.begun.elapsed().as_secs_f64();
        tracing::info!(pictures = self.pictures, seconds, "the window is closed");
    }

    /// Pictures a second, smoothed.
    pub fn fps(&self) -> f64 {
        self.fps
    }
}
