//! The question that both clients ask, as files for the one in Python, and the client in Rust.

use std::path::Path;

use glove_client::ask::connection::{Host, ServerChoice, ServerConnection};
use softgrasp_core::mesh::BuiltIn;
use softgrasp_protocol::{Ask, ModelHash, NodeChoice, Question, Request};

use crate::reference::{Reference, error_rel};
use crate::report::ReportError;
use crate::requests::{answer, upload};
use crate::sample::timed_ms;
use crate::scene::Pressed;

/// Method of all frames.
const METHOD: &str = "condensed";

/// One frame: from the numbers of its displacements to those of the answer, ms, and its error.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Trip {
    pub ms: f64,
    /// Relative to a direct solve.
    pub error_rel: f64,
}

/// A pressed cube, and the exact displacements of its surface for a load of 1.
pub(super) struct Asked {
    pub scene: Pressed,
    /// Three for each node of the surface, m.
    right: Vec<f64>,
}

/// Load of a frame: another one each time, to which the displacements are proportional.
fn scale(frame: usize) -> f64 {
    1.0 + 0.25 * (frame as f64).sin()
}

impl Asked {
    /// A cube of about so many nodes that is pressed at five of them.
    pub fn new(nodes: usize) -> Result<Self, ReportError> {
        let scene = Pressed::try_new(BuiltIn::Cube, nodes)?;
        let (model, known) = scene.model()?;
        let displacement = Reference::of(&model, &known)?.displacement;
        let of_node = |&node: &u32| displacement[3 * node as usize..3 * node as usize + 3].to_vec();
        let right = scene.surface.nodes.iter().flat_map(of_node).collect();
        Ok(Self { scene, right })
    }

    /// Writes mesh, material, question and exact answer as little-endian numbers.
    ///
    /// # Errors
    /// [`ReportError::Process`] for a file that cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), ReportError> {
        let Self { scene, right } = self;
        let floats = |name: &str, values: &mut dyn Iterator<Item = f64>| {
            write(folder, name, values.flat_map(f64::to_le_bytes).collect())
        };
        let numbers = |name: &str, values: &mut dyn Iterator<Item = u32>| {
            write(folder, name, values.flat_map(u32::to_le_bytes).collect())
        };
        let points = scene.mesh.vertices().iter();
        floats("points.f64", &mut points.flat_map(|p| [p.x, p.y, p.z]))?;
        numbers("tets.u32", &mut scene.mesh.tets().iter().flatten().copied())?;
        let material = [scene.material.young(), scene.material.poisson()];
        floats("material.f64", &mut material.into_iter())?;
        numbers("dofs.u32", &mut scene.pairs.iter().map(|(dof, _)| *dof))?;
        floats("displacements.f64", &mut scene.pairs.iter().map(|(_, u)| *u))?;
        numbers("nodes.u32", &mut scene.surface.nodes.iter().copied())?;
        floats("right.f64", &mut right.iter().copied())
    }
}

fn write(folder: &Path, name: &str, bytes: Vec<u8>) -> Result<(), ReportError> {
    let path = folder.join(name);
    std::fs::write(&path, bytes)
        .map_err(|source| ReportError::Process { what: path.display().to_string(), source })
}

/// Client in Rust with the model of the question.
pub(super) struct Rust<'a> {
    asked: &'a Asked,
    connection: ServerConnection,
    model: ModelHash,
    question: Question,
}

impl<'a> Rust<'a> {
    /// Connects and uploads the model.
    pub fn connect(address: &str, asked: &'a Asked) -> Result<Self, ReportError> {
        let host = Host::open(&ServerChoice::At(address.to_owned()), None)?;
        let mut connection = host.connect()?;
        let model = upload(&mut connection, asked.scene.upload())?;
        let nodes = NodeChoice::Nodes(asked.scene.surface.nodes.clone());
        let question = asked.scene.question(METHOD, 1.0, nodes);
        Ok(Self { asked, connection, model, question })
    }

    /// Asks a block of frames, one after the other.
    pub fn block(&mut self, first: usize, count: usize) -> Result<Vec<Trip>, ReportError> {
        (first..first + count).map(|frame| self.frame(scale(frame))).collect()
    }

    fn frame(&mut self, scale: f64) -> Result<Trip, ReportError> {
        let (ms, found) = timed_ms(|| -> Result<Vec<[f64; 3]>, ReportError> {
            let mut question = self.question.clone();
            question.known.iter_mut().for_each(|known| known.value *= scale);
            let reply = self.connection.ask(&Request::from(Ask::new(self.model, question)));
            Ok(answer(reply)?.displacements.into_f64())
        });
        let found = found?;
        let right = self.asked.right.iter().map(|u| scale * u);
        let error_rel = match 3 * found.len() == self.asked.right.len() {
            true => error_rel(found.iter().flatten().copied().zip(right)),
            false => f64::INFINITY,
        };
        Ok(Trip { ms, error_rel })
    }
}
