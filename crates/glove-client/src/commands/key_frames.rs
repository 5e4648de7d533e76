//! Files of the deformed object at key moments, written beside the ticks.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Context;
use softgrasp_core::mesh_io::{PointField, write_vtu};
use softgrasp_grasp::grasp::{GraspEvent, StateName};
use softgrasp_grasp::object::{RestShape, SoftObject};
use softgrasp_os::Beside;

use crate::object::file_writing::write_file;
use crate::run::tick_outcome::{LoopEvent, TickOutcome};

/// Writes the object when it starts to deform, just before its shape is kept or released, and after.
pub struct KeyFrames {
    folder: PathBuf,
    writer: Beside<Picture, anyhow::Result<()>>,
    /// Rest shape after the last tick, and the displacement from it, m.
    before: (Arc<RestShape>, Vec<[f64; 3]>),
}

/// File to be written.
struct Picture {
    path: PathBuf,
    rest: Arc<RestShape>,
    displacement: Vec<[f64; 3]>,
}

impl KeyFrames {
    /// Makes the folder and starts the thread that writes.
    ///
    /// # Errors
    /// Error of the operating system, in one line.
    pub fn start(folder: &Path, object: &SoftObject) -> anyhow::Result<Self> {
        std::fs::create_dir_all(folder)
            .with_context(|| format!("cannot make the folder {}", folder.display()))?;
        let writer = Beside::start("key frames", |picture: Picture| picture.write())
            .context("cannot start the thread that writes key frames")?;
        let before = (Arc::clone(object.rest_shape()), object.displacement().to_vec());
        Ok(Self { folder: folder.to_owned(), writer, before })
    }

    /// Passes the files of a tick to the thread.
    ///
    /// # Errors
    /// Error of a file of an earlier tick.
    pub fn add(
        &mut self,
        tick: u64,
        outcome: &TickOutcome,
        object: &SoftObject,
    ) -> anyhow::Result<()> {
        let now = (Arc::clone(object.rest_shape()), object.displacement().to_vec());
        for event in &outcome.events {
            let LoopEvent::Grasp(event) = event else { continue };
            let (name, (rest, displacement)) = match event {
                GraspEvent::Entered(StateName::Deforming) => ("deforming", &now),
                // The rest shape has just become the kept one: it is the squeezed shape.
                GraspEvent::ShapeKept => ("kept", &now),
                GraspEvent::Released | GraspEvent::TipLeft(_)
                    if self.before.1.iter().flatten().any(|&u| u != 0.0) =>
                {
                    ("squeezed", &self.before)
                }
                GraspEvent::Entered(StateName::Detached) => ("detached", &now),
                _ => continue,
            };
            self.writer.begin(Picture {
                path: self.folder.join(format!("{tick:05}-{name}.vtu")),
                rest: Arc::clone(rest),
                displacement: displacement.clone(),
            });
        }
        self.before = now;
        self.writer.take().unwrap_or(Ok(()))
    }

    /// Waits until all files are written.
    ///
    /// # Errors
    /// Error of the first file that could not be written.
    pub fn finish(mut self) -> anyhow::Result<()> {
        while self.writer.is_busy() {
            self.writer.wait().unwrap_or(Ok(()))?;
        }
        Ok(())
    }
}

impl Picture {
    fn write(self) -> anyhow::Result<()> {
        let field = PointField { name: "displacement", values: &self.displacement };
        Ok(write_file(&self.path, &write_vtu(self.rest.mesh(), &[field])?)?)
    }
}
