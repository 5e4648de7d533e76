//! Client that asks frame questions about one object and compares every answer with the exact one.

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

/// One round trip with its time, the server's times, and the error of the answer.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Trip {
    pub ms: f64,
    pub stages: StageMs,
    pub residual_rel: f64,
    pub error_rel: f64,
}

/// Question to the server, and the exact answer to it.
#[derive(Clone)]
pub(super) struct Asked {
    pub contact: ContactModel,
    pub method: &'static str,
    pub nodes: usize,
    pub surface_nodes: usize,
    upload: UploadModel,
    /// Question for a load of 1.
    pub question: Question,
    /// Exact displacements of the surface nodes for a load of 1, m.
    right: Vec<f64>,
    /// Error of `right` itself, relative.
    right_error_rel: f64,
}

impl Asked {
    /// Question with five prescribed nodes; `reference` is the exact answer.
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

    /// Question with the masks of five fingertips on the same object. The exact answer is one for all
    /// nodes that keeps balance and prescribed displacements, see [`verify`].
    ///
    /// [`ReportError`], also if there is no exact answer. [`ReportError`], also when there is no right
    /// answer.
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

    /// Question for another load; the displacements are proportional to it.
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

/// Client that asks about one object.
pub(super) struct Asker {
    pub asked: Asked,
    pub model: ModelHash,
    connection: ServerConnection,
    count: u32,
}

impl Asker {
    /// Connects and uploads the model if the server does not keep it.
    pub fn new(host: &Host, asked: Asked) -> Result<Self, ReportError> {
        let mut connection = host.connect()?;
        let model = upload(&mut connection, asked.upload.clone())?;
        Ok(Self { asked, model, connection, count: 0 })
    }

    /// Asks one frame question with a load of its own; compares the answer with the exact one.
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

    /// Answer, and the time from sending the question to having it, ms.
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
