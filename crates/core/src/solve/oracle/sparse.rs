//! Sparse Cholesky factor of `K11` (faer) in the order of nested dissection.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::perm::Perm;
use faer::prelude::*;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, Par, Side};

use crate::solve::k11::NotPositive;
use crate::solve::k11::SparseK11;

/// Order and symbolic analysis of `K11`.
pub struct Analysis {
    k11: SparseK11,
    symbolic: SymbolicCholesky<usize>,
}

/// Numerical factor over a symbolic analysis.
pub struct SparseFactor {
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f64>,
}

/// The machine could not hold the factor.
pub struct OutOfMemory;

// One faer thread: its own threads lose below 4000 nodes and would make the bits depend on their
// number. Parallel work across the elimination tree is a method of its own.
const PAR: Par = Par::Seq;

impl Analysis {
    /// Analyses `K11` under the elimination order `order[new] = old`.
    pub fn new(k11: SparseK11, order: Vec<usize>) -> Result<Self, OutOfMemory> {
        let n = order.len();
        let mut position = vec![0; n];
        for (new, &old) in order.iter().enumerate() {
            position[old] = new;
        }
        let order = Perm::new_checked(order.into_boxed_slice(), position.into_boxed_slice(), n);
        let pattern =
            SymbolicSparseColMatRef::new_checked(n, n, &k11.column_start, None, &k11.rows);
        let symbolic = factorize_symbolic_cholesky(
            pattern,
            Side::Lower,
            SymmetricOrdering::Custom(order.as_ref()),
            CholeskySymbolicParams::default(),
        )
        .map_err(|_| OutOfMemory)?;
        Ok(Self { k11, symbolic })
    }

    /// Bytes of the copy of `K11`, of the factor's values and of what they are computed in.
    pub fn bytes(&self) -> u64 {
        let k11 = self.k11.rows.len() * (size_of::<usize>() + size_of::<f64>());
        let values = self.symbolic.len_val() * size_of::<f64>();
        let scratch =
            self.symbolic.factorize_numeric_llt_scratch::<f64>(PAR, faer::Spec::default());
        (k11 + values + scratch.unaligned_bytes_required()) as u64
    }

    /// Number of stored entries of the factor.
    #[cfg(test)]
    pub fn fill(&self) -> usize {
        self.symbolic.len_val()
    }

    /// Numerical factor; consumes the copy of `K11`.
    ///
    /// # Errors
    /// [`NotPositive`]; faer names the pivot in the elimination order only, so the row is that of
    /// the order.
    pub fn factor(self) -> Result<SparseFactor, NotPositive> {
        let Self { k11, symbolic } = self;
        let n = symbolic.nrows();
        let pattern =
            SymbolicSparseColMatRef::new_checked(n, n, &k11.column_start, None, &k11.rows);
        let matrix = SparseColMatRef::new(pattern, &k11.values);
        let params = faer::Spec::default();
        let mut values = vec![0.0; symbolic.len_val()];
        let mut memory = MemBuffer::new(symbolic.factorize_numeric_llt_scratch::<f64>(PAR, params));
        let outcome = symbolic.factorize_numeric_llt(
            &mut values,
            matrix,
            Side::Lower,
            Default::default(),
            PAR,
            MemStack::new(&mut memory),
            params,
        );
        if let Err(faer::linalg::cholesky::llt::factor::LltError::NonPositivePivot { index }) =
            outcome
        {
            let row = symbolic.perm().map_or(index, |p| p.arrays().0[index.min(n - 1)]);
            return Err(NotPositive { row });
        }
        Ok(SparseFactor { symbolic, values })
    }
}

impl SparseFactor {
    /// Bytes held by the factor's values.
    pub fn bytes(&self) -> usize {
        std::mem::size_of_val(self.values.as_slice())
    }

    /// Solves `K11 x = b` in place.
    pub fn solve_in_place(&self, b: &mut [f64]) {
        let n = b.len();
        let mut memory = MemBuffer::new(self.symbolic.solve_in_place_scratch::<f64>(1, PAR));
        LltRef::new(&self.symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(b, n, 1),
            PAR,
            MemStack::new(&mut memory),
        );
    }
}
