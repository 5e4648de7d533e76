//! Questions beside other work: a new client's first model, and a new contact on a kept model.

use std::time::Instant;

use glove_client::ask::connection::ServerConnection;
use softgrasp_core::mesh::BuiltIn;
use softgrasp_protocol::{
    Ask, DofValue, MethodName, ModelHash, NodeChoice, Reply, Request, UploadModel,
};

use crate::random::Random;
use crate::report::{ReportError, check};
use crate::requests::{answer, upload};
use crate::scene::Pressed;

/// Client with a kept model that touches other nodes in every question, and new clients beside it.
pub(super) struct Probes {
    address: String,
    newcomer: UploadModel,
    contact: Contact,
    count: u32,
}

struct Contact {
    connection: ServerConnection,
    scene: Pressed,
    model: ModelHash,
    random: Random,
    /// Questions and answers, to be checked when the server has no work.
    answered: Vec<(Vec<DofValue>, Vec<[f64; 3]>)>,
}

/// Times of both questions, ms.
#[derive(Clone, Debug, Default)]
pub(super) struct Times {
    pub newcomer_ms: Vec<f64>,
    pub contact_ms: Vec<f64>,
}

/// Number of fingertips of a new contact.
const TOUCHED: usize = 5;
/// Largest relative difference of displacements by cached columns and by a factor, due to rounding.
const DIFFERENCE_MAX: f64 = 1e-9;

impl Probes {
    /// Uploads the model of the contacts and waits until its error bound is proven: from then on its
    /// server has no work.
    ///
    /// # Errors
    /// [`ReportError`].
    pub fn new(
        address: &str,
        newcomer_nodes: usize,
        contact_nodes: usize,
    ) -> Result<Self, ReportError> {
        let scene = Pressed::try_new(BuiltIn::Cube, contact_nodes)?;
        let mut connection = ServerConnection::connect(address)?;
        let model = upload(&mut connection, scene.upload())?;
        let question = scene.question("condensed", 1.0, NodeChoice::All);
        loop {
            let request = Request::from(Ask::new(model, question.clone()));
            let answer = answer(connection.ask(&request))?;
            if answer.report.error_bound_rel.is_some() {
                break;
            }
            std::thread::sleep(std::time::Duration::from_millis(50));
        }
        let newcomer = Pressed::try_new(BuiltIn::Cube, newcomer_nodes)?.upload();
        let contact = Contact { connection, scene, model, random: Random(7), answered: Vec::new() };
        Ok(Self { address: address.to_owned(), newcomer, contact, count: 0 })
    }

    /// Asks one of each, one after the other.
    ///
    /// # Errors
    /// [`ReportError`].
    pub fn ask(&mut self, times: &mut Times) -> Result<(), ReportError> {
        times.newcomer_ms.push(self.come_new()?);
        times.contact_ms.push(self.contact.touch()?);
        Ok(())
    }

    /// Connects, uploads a new model, and waits until it is ready; returns the time, ms.
    fn come_new(&mut self) -> Result<f64, ReportError> {
        self.count += 1;
        let mut model = self.newcomer.clone();
        for material in &mut model.materials {
            // Another model each time: its material differs in a late digit.
            material.young += f64::from(self.count);
        }
        let begun = Instant::now();
        let mut connection = ServerConnection::connect(self.address.as_str())?;
        let hash = upload(&mut connection, model)?;
        let took = 1e3 * begun.elapsed().as_secs_f64();
        connection.send(&Request::Drop(hash))?;
        Ok(took)
    }

    /// Asks all contacts again, by a factor, and compares; to be called when the server has no work.
    ///
    /// # Errors
    /// [`ReportError::Wrong`] for a wrong answer.
    pub fn check(&mut self) -> Result<usize, ReportError> {
        let Contact { connection, scene, model, answered, .. } = &mut self.contact;
        for (known, found) in answered.iter() {
            let right = ask(connection, scene, *model, known, "front")?;
            let pairs = || found.iter().flatten().zip(right.iter().flatten());
            let off = pairs().map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            let size = pairs().map(|(_, b)| b.abs()).fold(0.0, f64::max);
            check(|| "a new contact beside long work".to_owned(), off / size, DIFFERENCE_MAX)?;
        }
        Ok(answered.len())
    }
}

impl Contact {
    /// Presses nodes that have not been touched before; returns the time, ms.
    fn touch(&mut self) -> Result<f64, ReportError> {
        let nodes = &self.scene.surface.nodes;
        let mut touched: Vec<u32> = Vec::new();
        while touched.len() < TOUCHED {
            let node = nodes[self.random.below(nodes.len())];
            if !touched.contains(&node) {
                touched.push(node);
            }
        }
        touched.sort_unstable();
        let size = self.scene.mesh.size();
        let dofs = touched.iter().flat_map(|node| 3 * node..3 * node + 3);
        let known: Vec<DofValue> =
            dofs.map(|dof| DofValue { dof, value: 0.01 * size * f64::from(dof).sin() }).collect();
        let begun = Instant::now();
        let found = ask(&mut self.connection, &self.scene, self.model, &known, "auto")?;
        let took = 1e3 * begun.elapsed().as_secs_f64();
        self.answered.push((known, found));
        Ok(took)
    }
}

fn ask(
    connection: &mut ServerConnection,
    scene: &Pressed,
    model: ModelHash,
    known: &[DofValue],
    method: &str,
) -> Result<Vec<[f64; 3]>, ReportError> {
    let surface = NodeChoice::Nodes(scene.surface.nodes.clone());
    let mut question = scene.question(method, 1.0, surface);
    question.known = known.to_vec();
    question.method = MethodName::try_new(method).expect("the names of all methods can be sent");
    let request = Request::from(Ask::new(model, question));
    let reply: Result<Reply, _> = connection.ask(&request);
    Ok(answer(reply)?.displacements.into_f64())
}
