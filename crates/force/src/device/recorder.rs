//! The forces as comma-separated values, written by a thread of its own.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;

use super::error::DeviceError;
use crate::rendering::{PORTS, Rendered};

/// Writes the ticks in which a finger feels something.
#[derive(Debug)]
pub(crate) struct ForceRecorder {
    rows: Option<SyncSender<(f64, Rendered)>>,
    thread: Option<JoinHandle<std::io::Result<()>>>,
    path: PathBuf,
    /// Whether a force was there in the last tick.
    had_force: bool,
    lost: u64,
}

/// Ticks that may wait for the disk.
const WAITING_MAX: usize = 4096;
/// Names of the columns: s, finger from the thumb (0), m, N, J.
const HEADER: &str = "time,finger,x,y,z,fx,fy,fz,energy";

impl ForceRecorder {
    pub(super) fn create(path: &Path) -> Result<Self, DeviceError> {
        let file = File::create(path)
            .map_err(|source| DeviceError::File { path: path.to_owned(), source })?;
        let (rows, to_write) = sync_channel(WAITING_MAX);
        let thread = std::thread::Builder::new()
            .name("force record".to_owned())
            .spawn(move || write(file, &to_write))
            .map_err(DeviceError::Thread)?;
        let (rows, thread) = (Some(rows), Some(thread));
        Ok(Self { rows, thread, path: path.to_owned(), had_force: false, lost: 0 })
    }

    pub(super) fn render(&mut self, now_s: f64, rendered: &Rendered) {
        let has_force = rendered.forces.iter().any(|force| force.norm() > 0.0);
        // The first tick without force ends a touch in the file.
        if (has_force || self.had_force)
            && let Some(rows) = &self.rows
            && let Err(TrySendError::Full(_)) = rows.try_send((now_s, *rendered))
        {
            self.lost += 1;
        }
        self.had_force = has_force;
    }

    pub(super) fn close(mut self) -> Option<String> {
        self.rows = None;
        let written = self.thread.take()?.join();
        let path = self.path.display();
        match written {
            Ok(Ok(())) if self.lost == 0 => None,
            Ok(Ok(())) => Some(format!("{path}: {} ticks were not written in time", self.lost)),
            Ok(Err(error)) => Some(format!("{path}: {error}")),
            Err(_) => Some(format!("{path}: the thread that writes ended abnormally")),
        }
    }
}

fn write(file: File, rows: &Receiver<(f64, Rendered)>) -> std::io::Result<()> {
    let mut file = BufWriter::new(file);
    writeln!(file, "{HEADER}")?;
    for (now_s, rendered) in rows {
        for finger in 0..PORTS {
            let (place, force) = (rendered.places[finger], rendered.forces[finger]);
            let energy = rendered.energies[finger];
            if force.norm() == 0.0 && place.norm() == 0.0 {
                continue;
            }
            writeln!(
                file,
                "{now_s:.6},{finger},{:.9},{:.9},{:.9},{:.9},{:.9},{:.9},{energy:.12}",
                place.x, place.y, place.z, force.x, force.y, force.z,
            )?;
        }
    }
    file.flush()
}
