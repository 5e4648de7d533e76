//! What rank 0 orders from all ranks beside their parts: how to prepare, and what to find out.

use softgrasp_core::solve::memory::Bytes;

/// How the equations are prepared to be solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preparation {
    /// Multigrid by smoothed aggregation, PETSc's own.
    Gamg,
    /// Multigrid of hypre: steadier, and with bits that repeat, about twice the time.
    Hypre,
    /// Cholesky factor by MUMPS.
    Mumps,
}

impl Preparation {
    /// Number of the preparation.
    pub const fn number(self) -> u8 {
        match self {
            Self::Gamg => 0,
            Self::Hypre => 1,
            Self::Mumps => 2,
        }
    }

    fn of_number(number: u8) -> Option<Self> {
        [Self::Gamg, Self::Hypre, Self::Mumps].into_iter().find(|one| one.number() == number)
    }

    /// Name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Gamg => "multigrid (GAMG)",
            Self::Hypre => "multigrid (hypre)",
            Self::Mumps => "a Cholesky factor (MUMPS)",
        }
    }
}

/// One order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Order {
    /// Preparations, of which the next is tried where one fails.
    pub preparations: Vec<Preparation>,
    /// Whether error, rotation and strain are wanted.
    pub has_estimate: bool,
    /// Whether the digest of the matrix is wanted.
    pub has_digest: bool,
    /// Memory of each rank.
    pub memory_per_rank: Bytes,
}

impl Order {
    /// The order as bytes for another rank; what follows them is kept.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = vec![self.preparations.len() as u8];
        bytes.extend(self.preparations.iter().map(|one| one.number()));
        bytes.extend([u8::from(self.has_estimate), u8::from(self.has_digest)]);
        bytes.extend(self.memory_per_rank.0.to_le_bytes());
        bytes
    }

    /// The order at the beginning of bytes, and the bytes behind it; `None` if they are cut.
    pub fn from_bytes(bytes: &[u8]) -> Option<(Self, &[u8])> {
        let (count, rest) = bytes.split_first()?;
        let (numbers, rest) = rest.split_at_checked(usize::from(*count))?;
        let preparations =
            numbers.iter().map(|&number| Preparation::of_number(number)).collect::<Option<_>>()?;
        let (flags, rest) = rest.split_first_chunk::<2>()?;
        let (memory, rest) = rest.split_first_chunk::<8>()?;
        let order = Self {
            preparations,
            has_estimate: flags[0] != 0,
            has_digest: flags[1] != 0,
            memory_per_rank: Bytes(u64::from_le_bytes(*memory)),
        };
        Some((order, rest))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_order_comes_back_from_its_bytes_and_leaves_the_rest() {
        let order = Order {
            preparations: vec![Preparation::Gamg, Preparation::Hypre],
            has_estimate: true,
            has_digest: false,
            memory_per_rank: Bytes(7 << 30),
        };
        let mut bytes = order.to_bytes();
        bytes.push(99);
        assert_eq!(Order::from_bytes(&bytes), Some((order, &[99][..])));
        assert_eq!(Order::from_bytes(&bytes[..5]), None);
    }
}
