//! What an engine is asked, and the trait that engines implement.

use std::fmt;
use std::pin::Pin;
use std::sync::Arc;

use softgrasp_protocol::{Answer, ModelHash, Question, Rejected, TraceContext, UploadModel};

/// The answer that comes later; dropping it tells the engine that nobody waits any more.
pub type Answered<'a> = Pin<Box<dyn Future<Output = Result<Answer, Rejected>> + Send + 'a>>;

/// Answers linear questions in a server's place.
pub trait Engine: Send + Sync + fmt::Debug {
    /// Whether it answers every question of its server; else those that the server cannot.
    fn takes_all(&self) -> bool;

    /// Answers a question, or refuses it in the words of the wire.
    fn answer(&self, task: Task) -> Answered<'_>;
}

/// A linear question about a mesh that came along or a kept model.
#[derive(Clone, Debug)]
pub struct Task {
    /// Mesh, materials, element, and degrees of freedom that are known beside those of the question.
    pub model: Arc<UploadModel>,
    /// Name of the model if it is kept, so that it need not travel again.
    pub kept: Option<ModelHash>,
    /// Known displacements, forces, and what is wanted.
    pub question: Question,
    /// Values of the known displacements for further cases, m.
    pub cases: Vec<Vec<f64>>,
    /// Whether error, rotation and strain may be left out.
    pub without_estimate: bool,
    /// Trace that the request belongs to.
    pub trace: Option<TraceContext>,
}

/// A method by which several processes answer together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClusterMethod {
    /// Conjugate gradients with algebraic multigrid.
    Cg,
    /// A Cholesky factor.
    Factor,
}

impl ClusterMethod {
    /// Both methods.
    pub const ALL: [Self; 2] = [Self::Cg, Self::Factor];

    /// Name on the wire and in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Cg => "cluster-cg",
            Self::Factor => "cluster-factor",
        }
    }

    /// The method of a name, if it is one of these.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|method| method.name() == name)
    }
}

impl fmt::Display for ClusterMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
