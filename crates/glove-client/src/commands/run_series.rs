//! Files of the object at every tick of a run, written beside the ticks.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Context;
use nalgebra::{Isometry3, Point3};
use softgrasp_grasp::object::RestShape;
use softgrasp_os::Beside;

use crate::object::field_writing::{NodeVectors, encode_fields};
use crate::object::file_writing::write_file;
use crate::object::series::Series;
use crate::run::grasp_loop::GraspLoop;

/// Writes the object at each tick, where it is in the world.
pub(super) struct RunSeries {
    series: Series,
    writer: Beside<Moment, anyhow::Result<()>>,
    /// Time from tick to tick, s.
    tick_s: f64,
}

/// File to be written.
struct Moment {
    path: PathBuf,
    rest: Arc<RestShape>,
    /// Displacement of every node from rest, m, in the object's frame.
    elastic: Vec<[f64; 3]>,
    world_from_object: Isometry3<f64>,
}

impl RunSeries {
    /// Makes the folder and starts the thread that writes.
    ///
    /// # Errors
    /// Error of the operating system, in one line.
    pub(super) fn start(folder: &Path, tick_s: f64) -> anyhow::Result<Self> {
        let writer = Beside::start("series", Moment::write)
            .context("cannot start the thread that writes the series")?;
        Ok(Self { series: Series::create(folder)?, writer, tick_s })
    }

    /// Passes the object of a tick to the thread.
    ///
    /// # Errors
    /// Error of a file of an earlier tick.
    pub(super) fn add(&mut self, tick: u64, grasp_loop: &GraspLoop) -> anyhow::Result<()> {
        let object = grasp_loop.object();
        self.writer.begin(Moment {
            path: self.series.add(tick as f64 * self.tick_s),
            rest: Arc::clone(object.rest_shape()),
            elastic: object.displacement().to_vec(),
            world_from_object: *grasp_loop.world_from_object(),
        });
        self.writer.take().unwrap_or(Ok(()))
    }

    /// Waits until all files are written, and writes the one that lists them.
    ///
    /// # Errors
    /// Error of the first file that could not be written.
    pub(super) fn finish(mut self) -> anyhow::Result<()> {
        while self.writer.is_busy() {
            self.writer.wait().unwrap_or(Ok(()))?;
        }
        Ok(self.series.finish()?)
    }
}

impl Moment {
    fn write(self) -> anyhow::Result<()> {
        let rest = &self.rest;
        let moved = |(at_rest, u): (&Point3<f64>, &[f64; 3])| {
            let place = self.world_from_object * (at_rest + nalgebra::Vector3::from(*u));
            (place - at_rest).into()
        };
        let whole: Vec<[f64; 3]> =
            rest.mesh().vertices().iter().zip(&self.elastic).map(moved).collect();
        let vectors = [
            NodeVectors { name: "displacement", unit: "m", values: &whole },
            NodeVectors { name: "elastic_displacement", unit: "m", values: &self.elastic },
        ];
        let bytes = encode_fields(rest.mesh(), rest.regions().names(), &vectors, None)
            .context("cannot form the VTU file")?;
        Ok(write_file(&self.path, &bytes)?)
    }
}
