//! The thread that plays the force at 1 kHz on its own clock.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use nalgebra::Isometry3;

use crate::device::{Device, DeviceError};
use crate::newest::Newest;
use crate::rendering::{Moment, Rendering};
use crate::report::ForceReport;
use crate::safeguard::Release;
use crate::target::Target;

/// Forces of a run, on a thread of their own. Dropping it releases them.
#[derive(Debug)]
pub struct Renderer {
    newest: Arc<Newest>,
    ends: Arc<AtomicBool>,
    target: Target,
    thread: Option<JoinHandle<ForceReport>>,
}

/// Why there is no force.
#[derive(Debug, thiserror::Error)]
pub enum ForceError {
    /// The device cannot be opened.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// The system gives no thread.
    #[error("the system gives no thread for the force")]
    Thread(#[source] io::Error),
}

/// Time before a moment for which the thread stays awake: it is usually woken as late as this.
const AWAKE: Duration = Duration::from_micros(150);

impl Renderer {
    /// Opens the device and starts the thread.
    ///
    /// # Errors
    /// [`ForceError`].
    pub fn start(target: Target) -> Result<Self, ForceError> {
        let device = Device::open(&target)?;
        let (newest, ends) = (Arc::new(Newest::default()), Arc::new(AtomicBool::new(false)));
        let mut playing = Playing {
            newest: Arc::clone(&newest),
            ends: Arc::clone(&ends),
            rendering: Rendering::new(target.limits()),
            device,
            report: ForceReport { device: target.name().to_owned(), ..ForceReport::default() },
            began: Instant::now(),
            world_from_bodies: Vec::new(),
            hand_s: f64::NEG_INFINITY,
            answer_s: None,
            is_server_lost: false,
        };
        let work = move || {
            playing.play();
            playing.finish()
        };
        let thread = std::thread::Builder::new().name("force".to_owned()).spawn(work);
        Ok(Self { newest, ends, target, thread: Some(thread.map_err(ForceError::Thread)?) })
    }

    /// Where the ticks of the run put answers and hands.
    pub fn newest(&self) -> &Arc<Newest> {
        &self.newest
    }

    /// Where the forces go.
    pub fn target(&self) -> &Target {
        &self.target
    }

    /// Releases the forces and tells of them.
    pub fn finish(mut self) -> ForceReport {
        self.ends.store(true, Ordering::Relaxed);
        self.thread.take().and_then(|thread| thread.join().ok()).unwrap_or_default()
    }
}

impl Drop for Renderer {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            tracing::error!("the thread of the force ended abnormally");
        }
    }
}

/// What the thread works with.
struct Playing {
    newest: Arc<Newest>,
    ends: Arc<AtomicBool>,
    rendering: Rendering,
    device: Device,
    report: ForceReport,
    began: Instant,
    world_from_bodies: Vec<Isometry3<f64>>,
    hand_s: f64,
    answer_s: Option<f64>,
    is_server_lost: bool,
}

impl Playing {
    fn play(&mut self) {
        let period = self.rendering.limits().period;
        self.report.rate_hz = period.recip();
        self.report.is_urgent = softgrasp_os::be_urgent().is_ok();
        self.began = Instant::now();
        let mut next: u64 = 0;
        while !self.ends.load(Ordering::Relaxed) {
            let due = self.began + Duration::from_secs_f64(period * next as f64);
            wait_until(due);
            let begun = Instant::now();
            let late = begun.saturating_duration_since(due).as_secs_f64();
            self.tick(begun, next);
            self.report.ticks += 1;
            self.report.late_share += f64::from(u8::from(late > 0.5 * period));
            self.report.late_worst_ms = self.report.late_worst_ms.max(1e3 * late);
            let computed = begun.elapsed().as_secs_f64();
            self.report.computed_worst_ms = self.report.computed_worst_ms.max(1e3 * computed);
            // A tick is played in its own period or never.
            let now = (self.began.elapsed().as_secs_f64() / period) as u64;
            self.report.missed += now.saturating_sub(next + 1);
            next = (next + 1).max(now);
        }
    }

    fn tick(&mut self, now: Instant, number: u64) {
        self.look();
        let now_s = self.seconds(now);
        let device_fault = self.device.is_lost(now).then_some(Release::DeviceLost);
        let server_fault = self.is_server_lost.then_some(Release::ServerLost);
        let moment = Moment {
            now_s,
            answer_s: self.answer_s,
            world_from_bodies: &self.world_from_bodies,
            hand_s: self.hand_s,
            device: self.device.place(),
            fault: device_fault.or(server_fault),
        };
        let rendered = self.rendering.tick(&moment);
        if let (Some(answer_s), true) = (self.answer_s, rendered.share > 0.0) {
            let age = 1e3 * (now_s - answer_s);
            let has_force = rendered.forces.iter().any(|force| force.norm() > 0.0);
            if has_force {
                self.report.answer_age_worst_ms = self.report.answer_age_worst_ms.max(age);
            }
        }
        self.device.render(now_s, number, &rendered);
    }

    /// Takes what the run has put there since the last tick.
    fn look(&mut self) {
        let Some(held) = self.newest.take() else { return };
        self.is_server_lost = held.is_server_lost;
        if let Some((poses, seen_at)) = held.hand {
            (self.world_from_bodies, self.hand_s) = (poses, self.seconds(seen_at));
        }
        if let Some((system, asked_at)) = held.answer {
            self.report.answers += 1;
            self.answer_s = Some(self.seconds(asked_at));
            self.rendering.take(system);
        }
    }

    /// Seconds since the beginning; negative before it.
    fn seconds(&self, moment: Instant) -> f64 {
        match moment.checked_duration_since(self.began) {
            Some(after) => after.as_secs_f64(),
            None => -self.began.duration_since(moment).as_secs_f64(),
        }
    }

    fn finish(mut self) -> ForceReport {
        softgrasp_os::be_ordinary();
        let played = (self.report.ticks + self.report.missed).max(1) as f64;
        self.report.late_share = (self.report.late_share + self.report.missed as f64) / played;
        self.report.add_rendering(&self.rendering);
        self.report.device_failed = self.device.close();
        self.report
    }
}

/// Returns at a moment: sleeps until shortly before it and stays awake for the rest.
fn wait_until(then: Instant) {
    let left = then.saturating_duration_since(Instant::now());
    if left > AWAKE {
        std::thread::sleep(left - AWAKE);
    }
    while Instant::now() < then {
        std::thread::yield_now();
    }
}
