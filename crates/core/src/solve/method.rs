//! The methods that answer a question, the stages of an answer, and their names.

use std::fmt;
use std::str::FromStr;

/// How displacements are found: by a factor or inverse of `K11`, without one, or from kept columns of
/// the compliance.
///
/// Besides the methods below there are reference methods, which tests and reports compare with; they
/// are not part of this page, and [`Method::DIRECT`] and their names reach them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Method {
    /// Gauss–Jordan elimination of Appendix A pivot by pivot, rows in parallel: the thesis's own
    /// loop.
    #[doc(hidden)]
    GaussJordanPlain,
    /// Gauss–Jordan elimination by panels of pivots, as products of matrices.
    #[doc(hidden)]
    GaussJordan,
    /// Explicit inverse in tiles, by symmetric sweeps.
    #[doc(hidden)]
    DenseInverse,
    /// Tiled dense Cholesky factor.
    #[doc(hidden)]
    DenseCholesky,
    /// Sparse Cholesky factor in a nested-dissection order, one thread.
    #[doc(hidden)]
    SparseCholesky,
    /// Sparse Cholesky factor over the tree of fronts, all threads.
    Front,
    /// [`Method::Front`] in single precision, refined in double.
    FrontMixed,
    /// Conjugate gradients preconditioned by the single-precision factor, to a stated residual.
    Pcg,
    /// Conjugate gradients preconditioned by a hierarchy of coarser systems, without a factor of
    /// `K11`, to a stated residual.
    Multigrid,
    /// Kept columns of the compliance and a small dense system ([`super::condensed`]).
    Condensed,
}

/// No method has the name.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "no method is called '{name}'; there are {}, {} and auto",
    Method::DIRECT.map(Method::name).join(", "),
    Method::Condensed
)]
pub struct UnknownMethod {
    /// The name given.
    pub name: String,
}

impl Method {
    /// The methods that answer with `K11` of one partition: those that factor or invert it, slowest
    /// first, then the one that does without.
    pub const DIRECT: [Self; 9] = [
        Self::GaussJordanPlain,
        Self::GaussJordan,
        Self::DenseInverse,
        Self::DenseCholesky,
        Self::SparseCholesky,
        Self::Front,
        Self::FrontMixed,
        Self::Pcg,
        Self::Multigrid,
    ];

    /// Name on the command line, on the wire and in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::GaussJordanPlain => "gauss-jordan-plain",
            Self::GaussJordan => "gauss-jordan",
            Self::DenseInverse => "dense-inverse",
            Self::DenseCholesky => "dense-cholesky",
            Self::SparseCholesky => "sparse-cholesky",
            Self::Front => "front",
            Self::FrontMixed => "front-mixed",
            Self::Pcg => "pcg",
            Self::Multigrid => "multigrid",
            Self::Condensed => "condensed",
        }
    }

    /// The method of a name, or `None` for `auto`, which leaves the choice open.
    ///
    /// # Errors
    /// [`UnknownMethod`] with all names there are.
    pub fn named_or_auto(name: &str) -> Result<Option<Self>, UnknownMethod> {
        match name {
            "auto" => Ok(None),
            name => name.parse().map(Some),
        }
    }

    /// The method with a memory limit.
    ///
    /// Units: `limit` bytes.
    pub const fn within(self, limit: u64) -> Within {
        Within { method: self, limit }
    }

    /// Whether it stops at a residual and an estimated error, so that a larger error is sooner found.
    pub const fn stops_early(self) -> bool {
        matches!(self, Self::Pcg | Self::Multigrid)
    }

    /// Whether its factor is in single precision.
    pub const fn is_single(self) -> bool {
        matches!(self, Self::FrontMixed | Self::Pcg)
    }

    /// Precision of the factor, inverse or hierarchy.
    pub const fn precision(self) -> &'static str {
        match self {
            Self::Multigrid => "f32 hierarchy, f64 residual",
            _ if self.is_single() => "f32 factor, f64 residual",
            _ => "f64",
        }
    }

    /// Whether it factors over the tree of fronts.
    pub const fn has_fronts(self) -> bool {
        matches!(self, Self::Front | Self::FrontMixed | Self::Pcg)
    }

    /// Whether it makes use of the zeros of the stiffness, and so orders the nodes first.
    pub const fn is_sparse(self) -> bool {
        matches!(
            self,
            Self::SparseCholesky | Self::Front | Self::FrontMixed | Self::Pcg | Self::Condensed
        )
    }

    /// Bytes that the factor or inverse of `n` unknowns stays below, but for a few rows of the
    /// matrix; `None` where it depends on the sparsity.
    pub fn dense_bytes(self, n: usize) -> Option<u64> {
        let square = 8 * (n as u64) * (n as u64);
        match self {
            Self::GaussJordanPlain | Self::GaussJordan | Self::DenseInverse => Some(square),
            Self::DenseCholesky => Some(square / 2),
            Self::SparseCholesky
            | Self::Front
            | Self::FrontMixed
            | Self::Pcg
            | Self::Multigrid
            | Self::Condensed => None,
        }
    }
}

/// A method, and the memory that its factor or inverse may take while it is made.
///
/// ```
/// use softgrasp_core::solve::{Method, Within};
///
/// let anything: Within = Method::Front.into();
/// assert_eq!(anything.limit, u64::MAX);
/// let at_most_a_gigabyte = Method::Front.within(1 << 30);
/// assert_eq!(at_most_a_gigabyte.method, Method::Front);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Within {
    /// Method that factors or inverts.
    pub method: Method,
    /// Bytes that the factor or inverse may take.
    pub limit: u64,
}

impl From<Method> for Within {
    fn from(method: Method) -> Self {
        method.within(u64::MAX)
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Method {
    type Err = UnknownMethod;

    fn from_str(name: &str) -> Result<Self, UnknownMethod> {
        let all = Self::DIRECT.into_iter().chain([Self::Condensed]);
        all.into_iter()
            .find(|m| m.name() == name)
            .ok_or_else(|| UnknownMethod { name: name.to_owned() })
    }
}

/// A stage of the work. The core has no clock: it announces each stage as it begins, and whoever
/// called takes the time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Stiffness from mesh and material.
    Assemble,
    /// Fill-reducing order and symbolic analysis.
    Order,
    /// Numerical factor or inverse of `K11`.
    Factor,
    /// Right-hand side, substitution, refinement, residual, reactions.
    Solve,
}
