//! A client that asks for frames of one object and compares every answer with the right one.

use glove_client::ask::connection::{Host, ServerConnection};
use softgrasp_grasp::object::ContactModel;
use softgrasp_protocol::{
    Answer, Ask, MethodName, ModelHash, NodeChoice, Question, Request, StageMs, UploadModel,
};

use crate::contact::{Tips, WANT_ALL, verify};
use crate::echo::Waiting;
use crate::reference::{Reference, error_rel};
use crate::report::{ReportError, check};
use crate::requests::{answer, upload};
use crate::sample::timed_ms;
use crate::scene::Pressed;

/// Largest error, relative to a direct solve, with which a time is reported.
const ERROR_ALLOWED: f64 = 1e-9;

/// One round trip.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Trip {
    pub ms: f64,
    pub stages: StageMs,
    pub residual_rel: f64,
    pub error_rel: f64,
}

/// What is asked of the server, and the right answer to it.
#[derive(Clone)]
pub(super) struct Asked {
    pub contact: ContactModel,
    pub method: &'static str,
    pub nodes: usize,
    pub surface_nodes: usize,
    upload: UploadModel,
    /// The question for a load of one.
    pub question: Question,
    /// Right displacements of the surface nodes for a load of one, m.
    right: Vec<f64>,
    /// How far `right` itself may be off.
    right_error_rel: f64,
}

impl Asked {
    /// Five nodes displaced; `reference` is the right answer.
    pub fn by_vertices(scene: &Pressed, reference: &Reference, method: &'static str) -> Self {
        let surface = scene.surface.nodes.clone();
        Self {
            contact: ContactModel::Vertex,
            method,
            nodes: scene.mesh.node_count(),
            surface_nodes: surface.len(),
            upload: scene.upload(),
            right: of_nodes(&surface, |n| {
                [0, 1, 2].map(|axis| reference.displacement[3 * n as usize + axis])
            }),
            question: scene.question(method, 1.0, NodeChoice::Nodes(surface)),
            right_error_rel: 0.0,
        }
    }

    /// The masks of five fingertips displaced, in the same object; the right answer is one of the
    /// whole object that keeps balance and displacements, see [`verify`].
    ///
    /// # Errors
    /// [`ReportError`], also when there is no right answer.
    pub fn by_masks(host: &Host, nodes: usize) -> Result<Self, ReportError> {
        const METHOD: &str = "condensed";
        let tips = Tips::grip(nodes)?;
        let method = MethodName::try_new(METHOD).expect("the name of a method can be sent");
        let question = |want| Question {
            method: method.clone(),
            ..tips.question(ContactModel::Mask, 1.0, want)
        };
        let mut asked = Self {
            contact: ContactModel::Mask,
            method: METHOD,
            nodes: tips.mesh.node_count(),
            surface_nodes: tips.surface.nodes.len(),
            upload: tips.upload(),
            question: question(WANT_ALL),
            right: Vec::new(),
            right_error_rel: 0.0,
        };
        let answer = Asker::new(host, asked.clone())?.ask(1.0, Waiting::Asleep)?.1;
        asked.right_error_rel = verify(&tips, &asked.question, &answer, ERROR_ALLOWED)?;
        let whole = answer.displacements.into_f64();
        asked.right = of_nodes(&tips.surface.nodes, |n| whole[n as usize]);
        asked.question = question(tips.want_surface());
        Ok(asked)
    }

    /// The question for another load; displacements are proportional to it.
    fn scaled(&self, scale: f64) -> Question {
        let mut question = self.question.clone();
        question.known.iter_mut().for_each(|known| known.value *= scale);
        question.mask_displacements.iter_mut().flatten().for_each(|u| *u *= scale);
        question
    }
}

fn of_nodes(nodes: &[u32], displacement: impl Fn(u32) -> [f64; 3]) -> Vec<f64> {
    nodes.iter().flat_map(|&n| displacement(n)).collect()
}

/// A client of one object.
pub(super) struct Asker {
    pub asked: Asked,
    pub model: ModelHash,
    connection: ServerConnection,
    count: u32,
}

impl Asker {
    /// Connects and makes sure that the server has the model.
    pub fn new(host: &Host, asked: Asked) -> Result<Self, ReportError> {
        let mut connection = host.connect()?;
        let model = upload(&mut connection, asked.upload.clone())?;
        Ok(Self { asked, model, connection, count: 0 })
    }

    /// One frame with its own load, compared with the right answer.
    pub fn frame(&mut self, waiting: Waiting) -> Result<(Trip, Answer), ReportError> {
        self.count += 1;
        // Another load each time; the displacements are proportional to it.
        let scale = 1.0 + 0.25 * f64::from(self.count).sin();
        let (ms, answer) = self.ask(scale, waiting)?;
        let got = answer.displacements.clone().into_f64();
        let right = self.asked.right.iter().map(|u| scale * u);
        let error_rel = match got.len() == self.asked.surface_nodes {
            true => error_rel(got.iter().flatten().copied().zip(right)),
            false => f64::INFINITY,
        };
        let error_rel = error_rel.max(self.asked.right_error_rel);
        let Asked { contact, method, .. } = &self.asked;
        check(|| format!("frame of {contact} by {method}"), error_rel, ERROR_ALLOWED)?;
        let (stages, residual_rel) = (answer.report.stage_ms, answer.report.residual_rel);
        Ok((Trip { ms, stages, residual_rel, error_rel }, answer))
    }

    /// An answer, and the time from asking to having it, ms.
    fn ask(&mut self, scale: f64, waiting: Waiting) -> Result<(f64, Answer), ReportError> {
        let question = self.asked.scaled(scale);
        let request = Request::from(Ask::new(self.model, question));
        let (ms, reply) = timed_ms(|| match waiting {
            Waiting::Asleep => self.connection.ask(&request),
            Waiting::Awake => self.connection.ask_awake(&request),
        });
        Ok((ms, answer(reply)?))
    }
}
