//! Ways in which cases are asked: every method with every element, `condensed`, masks, and the server.

use glove_client::ask::connection::Host;
use softgrasp_core::model::Element;
use softgrasp_core::solve::Method;
use softgrasp_core::solve::rates::ERROR_ITERATED;

use super::answer::Answer;
use super::case::{Allowed, Case, Question, Reach};
use super::refusal::{Reason, Refusal};
use super::{in_process, over_socket};

/// Way in which a case is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
    /// By a factor or inverse of `K11`.
    Direct(Element, Method),
    /// By columns of the compliance.
    Condensed(Element),
    /// By columns of the compliance, with every touched node held by a mask of that node alone.
    Masks(Element),
    /// By one request to a server, which chooses the method.
    Server(Element),
    /// By a frame question about a model that the server keeps.
    Frame(Element),
    /// By a frame question with masks.
    MaskFrame(Element),
}

impl Way {
    /// All ways of this reach.
    pub fn of(reach: Reach) -> Vec<Self> {
        let all = |element: Element| {
            let direct = Method::DIRECT.into_iter().map(move |m| Self::Direct(element, m));
            // Ten-node elements are not condensed.
            let linear = [Self::Condensed, Self::Masks, Self::MaskFrame].map(|way| way(element));
            let linear = linear.into_iter().filter(move |_| element != Element::Tet10);
            direct.chain(linear).chain([Self::Server(element), Self::Frame(element)])
        };
        let all = Element::ALL.into_iter().flat_map(all);
        let is_of_each_kind = |way: &Self| match way {
            Self::Direct(_, method) => {
                matches!(
                    method,
                    Method::GaussJordan | Method::Front | Method::FrontMixed | Method::Multigrid
                )
            }
            Self::Condensed(_) | Self::Masks(_) | Self::Server(_) => true,
            // Two hundred models, each proven in the background, are another question.
            Self::Frame(_) | Self::MaskFrame(_) => false,
        };
        let is_for_large = |way: &Self| match way {
            Self::Direct(element, method) => {
                let by_auto = matches!(method, Method::Front | Method::FrontMixed | Method::Pcg);
                *element == Element::Tet4 && by_auto
            }
            Self::Condensed(element) | Self::Server(element) => *element == Element::Tet4,
            Self::Masks(_) | Self::Frame(_) | Self::MaskFrame(_) => false,
        };
        match reach {
            Reach::All => all.collect(),
            Reach::OfEachKind => all.filter(is_of_each_kind).collect(),
            Reach::Large => all.filter(is_for_large).collect(),
        }
    }

    pub fn element(self) -> Element {
        match self {
            Self::Direct(element, _)
            | Self::Condensed(element)
            | Self::Masks(element)
            | Self::Server(element)
            | Self::Frame(element)
            | Self::MaskFrame(element) => element,
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Direct(_, method) => method.name(),
            Self::Condensed(_) => "condensed",
            Self::Masks(_) => "condensed, masks",
            Self::Server(_) => "server, one request",
            Self::Frame(_) => "server, frame",
            Self::MaskFrame(_) => "server, frame of masks",
        }
    }

    pub fn precision(self) -> &'static str {
        match self {
            Self::Direct(_, method) => method.precision(),
            _ => "f64",
        }
    }

    /// Whether the factor of this way is in single precision.
    pub fn is_single(self) -> bool {
        matches!(self, Self::Direct(_, method) if method.is_single())
    }

    /// Outcomes that a case allows this way. One without a factor may also refuse a weakly held body, and
    /// state a larger error than a factor has.
    pub fn allowed(self, case: &Case) -> Allowed {
        match self {
            Self::Direct(_, Method::Multigrid) => {
                Allowed { degraded: true, refused: true, ..case.double }
            }
            _ if self.is_single() => case.single,
            _ => case.double,
        }
    }

    /// Right reason of a refusal: that of the case, or weakness if only this way may refuse.
    pub fn reason(self, case: &Case) -> Reason {
        let is_own = self.allowed(case).refused && !case.double.refused && !self.is_single();
        if is_own { Reason::Weak } else { case.reason }
    }

    /// Relative error that this way stops at; 0 if it stops at rounding.
    pub fn promised_rel(self) -> f64 {
        match self {
            Self::Direct(_, Method::Multigrid) => ERROR_ITERATED,
            _ => 0.0,
        }
    }

    /// Reason why this way may refuse a weakly held body although another way answers; `None` if it may
    /// not.
    pub fn limit(self) -> Option<&'static str> {
        match self {
            Self::Direct(
                _,
                Method::GaussJordanPlain | Method::GaussJordan | Method::DenseInverse,
            ) => Some("an explicit inverse loses digits that a factor keeps"),
            Self::Direct(_, Method::Multigrid) => Some(
                "steps without a factor come to a halt on nearly incompressible or flat elements",
            ),
            Self::Condensed(_) | Self::Masks(_) => {
                Some("a compliance between contacts loses digits that a factor of K11 keeps")
            }
            Self::MaskFrame(_) => Some("masks are answered by condensed only"),
            Self::Direct(..) | Self::Server(_) | Self::Frame(_) => None,
        }
    }

    /// Answers a question in this process, on the current rayon pool, or by the server.
    ///
    /// # Errors
    /// [`Refusal`]: the reason why there is no answer.
    pub fn answer(self, question: &Question, host: &Host) -> Result<Answer, Refusal> {
        match self {
            Self::Direct(element, method) => in_process::direct(question, element, method),
            Self::Condensed(element) => in_process::condensed(question, element, false),
            Self::Masks(element) => in_process::condensed(question, element, true),
            Self::Server(element) => over_socket::solve(question, element, host),
            Self::Frame(element) => over_socket::frame(question, element, false, host),
            Self::MaskFrame(element) => over_socket::frame(question, element, true, host),
        }
    }
}
