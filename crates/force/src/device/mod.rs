//! Devices that take forces: each has a thread of its own, so that no tick waits for a line.

mod error;
mod haply;
pub mod haply_message;
mod level;
mod link;
mod lucid;
mod recorder;

use std::time::Instant;

use nalgebra::Vector3;

use crate::limits::FULL_LEVEL;
use crate::rendering::{PORTS, Rendered};
use crate::target::Target;

pub use error::DeviceError;
pub use level::datagram;
pub use lucid::line_of;

/// A device that is open, or a file.
#[derive(Debug)]
pub(crate) enum Device {
    Haply(haply::HaplyLink),
    Lucid(lucid::LucidLink),
    Level(level::LevelSender),
    Record(recorder::ForceRecorder),
}

impl Device {
    /// Opens a device. A service that does not answer yet is no error: it is looked for again and again.
    pub(crate) fn open(target: &Target) -> Result<Self, DeviceError> {
        Ok(match target {
            Target::Haply { url } => Self::Haply(haply::HaplyLink::open(url)?),
            Target::Lucid { port } => Self::Lucid(lucid::LucidLink::open(port)?),
            Target::Level { address } => Self::Level(level::LevelSender::open(address)?),
            Target::Record { path } => Self::Record(recorder::ForceRecorder::create(path)?),
        })
    }

    /// Place of the device, m, world; `None` for one without a place of its own.
    pub(crate) fn place(&self) -> Option<Vector3<f64>> {
        match self {
            Self::Haply(link) => link.place(),
            Self::Lucid(_) | Self::Level(_) | Self::Record(_) => None,
        }
    }

    /// Whether the device does not answer.
    pub(crate) fn is_lost(&self, now: Instant) -> bool {
        match self {
            Self::Haply(link) => link.is_lost(now),
            Self::Lucid(link) => link.is_lost(now),
            Self::Level(_) | Self::Record(_) => false,
        }
    }

    /// Hands the forces of a tick over. Never waits.
    pub(crate) fn render(&mut self, now_s: f64, tick: u64, rendered: &Rendered) {
        match self {
            Self::Haply(link) => link.render(rendered.forces[0]),
            Self::Lucid(link) => link.render(levels(&rendered.forces)),
            Self::Level(sender) => sender.render(now_s, tick, levels(&rendered.forces)),
            Self::Record(recorder) => recorder.render(now_s, rendered),
        }
    }

    /// Releases the device; the reason if something has failed on the way.
    pub(crate) fn close(self) -> Option<String> {
        match self {
            Self::Haply(link) => link.close(),
            Self::Lucid(link) => link.close(),
            Self::Level(sender) => sender.close(),
            Self::Record(recorder) => recorder.close(),
        }
    }
}

/// Level of each finger, 0 to 1: its force over that of a firm pinch.
pub fn levels(forces: &[Vector3<f64>; PORTS]) -> [f64; PORTS] {
    forces.map(|force| {
        let level = force.norm() / FULL_LEVEL;
        // A NaN must not brake a finger.
        if level.is_finite() { level.clamp(0.0, 1.0) } else { 0.0 }
    })
}
