//! The inner loops of factor and solves: products of strips that stay in registers.
//!
//! A *strip* is one column of a slab, or the numbers of one row for several right-hand sides. All
//! functions are inlined into closures that pulp compiles for the processor's vectors.

use pulp::Simd;

use super::Real;

/// Vectors of a strip that stay in registers together, where there are 32.
const VECTORS_MAX: usize = 3;

/// Strips of both factors that stay in the nearest cache together: 24 of 32 KiB.
pub(super) const DEPTH: usize = 64;

/// Columns that are computed at once.
///
/// 3 vectors × 8 columns fill 24 of 32 registers, 2 × 6 fill 12 of 16. Compilers move sums of 3 × 4
/// through memory, because all 16 registers have a number in them then, which halves the rate.
#[inline(always)]
const fn columns_at_once<S: Simd>() -> usize {
    if S::REGISTER_COUNT >= 32 { 8 } else { 6 }
}

/// The second factor of a product, B of `C − A B`.
#[derive(Clone, Copy)]
pub(super) enum Factors<'a, T> {
    /// Number (l, j) is number `first + j` of strip l: rows of a slab.
    Rows { strips: &'a [T], first: usize },
    /// Number (l, j) is number l of strip j: columns of a slab.
    Columns { strips: &'a [T] },
    /// Number l, for one column only.
    One { values: &'a [T] },
}

/// Whether a product is taken off what is there or off zero.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Onto {
    There,
    Zero,
}

/// `C − A B`, `columns` strips of C at once or one after another as registers allow.
///
/// Shapes: A k strips, C `columns` strips, both of `width` numbers; B k × `columns`, its own strips
/// of [`Real::SLAB`] numbers. `width` is a multiple of the processor's vectors.
#[inline(always)]
pub(super) fn subtract_product<S: Simd, T: Real>(
    simd: S,
    (into, onto): (&mut [T], Onto),
    a: &[T],
    b: Factors<'_, T>,
    width: usize,
    columns: usize,
) {
    let mut from = 0;
    while from < columns {
        let part = &mut into[from * width..];
        let b = b.from(from);
        from += match columns_at_once::<S>().min(columns - from) {
            8.. => some_columns::<S, T, 8>(simd, (part, onto), a, b, width),
            6.. => some_columns::<S, T, 6>(simd, (part, onto), a, b, width),
            4.. => some_columns::<S, T, 4>(simd, (part, onto), a, b, width),
            2.. => some_columns::<S, T, 2>(simd, (part, onto), a, b, width),
            _ => some_columns::<S, T, 1>(simd, (part, onto), a, b, width),
        };
    }
}

/// [`subtract_product`] with B in rows, [`DEPTH`] strips after another, so that what the next
/// columns of C read again stays in the nearest cache.
///
/// Shapes: `a` k strips of `width` numbers, `b` k strips of [`Real::SLAB`] numbers, `into` `columns`
/// strips of `width` numbers.
#[inline(always)]
pub(super) fn subtract_deep<S: Simd, T: Real>(
    simd: S,
    into: &mut [T],
    a: &[T],
    b: &[T],
    width: usize,
    columns: usize,
) {
    for (a, b) in a.chunks(DEPTH * width).zip(b.chunks(DEPTH * T::SLAB)) {
        let b = Factors::Rows { strips: b, first: 0 };
        subtract_product(simd, (&mut *into, Onto::There), a, b, width, columns);
    }
}

impl<'a, T: Real> Factors<'a, T> {
    /// The factors from a later column on.
    #[inline(always)]
    fn from(self, column: usize) -> Self {
        match self {
            Self::Rows { strips, first } => Self::Rows { strips, first: first + column },
            Self::Columns { strips } => Self::Columns { strips: &strips[column * T::SLAB..] },
            Self::One { .. } => self,
        }
    }
}

/// N columns of C; returns N.
#[inline(always)]
fn some_columns<S: Simd, T: Real, const N: usize>(
    simd: S,
    (into, onto): (&mut [T], Onto),
    a: &[T],
    b: Factors<'_, T>,
    width: usize,
) -> usize {
    let lanes = size_of::<T::Vector<S>>() / size_of::<T>();
    let (strip, a) = (width / lanes, T::vectors::<S>(a));
    let into = &mut T::vectors_mut::<S>(into)[..N * strip];
    let mut from = 0;
    while from < strip {
        let into = (&mut *into, onto);
        from += match strip - from {
            // One column reads A once: from first to last byte.
            6.. if N == 1 => part::<S, T, N, 6>(simd, into, a, b, (strip, from)),
            VECTORS_MAX.. if S::REGISTER_COUNT >= 32 => {
                part::<S, T, N, VECTORS_MAX>(simd, into, a, b, (strip, from))
            }
            2.. => part::<S, T, N, 2>(simd, into, a, b, (strip, from)),
            _ => part::<S, T, N, 1>(simd, into, a, b, (strip, from)),
        };
    }
    N
}

/// V vectors of N columns of C, in registers; returns V.
#[inline(always)]
fn part<S: Simd, T: Real, const N: usize, const V: usize>(
    simd: S,
    (into, onto): (&mut [T::Vector<S>], Onto),
    a: &[T::Vector<S>],
    b: Factors<'_, T>,
    (strip, from): (usize, usize),
) -> usize {
    let zero = T::splat(simd, T::ZERO);
    let mut sum = [[zero; V]; N];
    match b {
        Factors::Rows { strips, first } => {
            for (a, b) in a.chunks_exact(strip).zip(strips.chunks_exact(T::SLAB)) {
                add::<S, T, N, V>(simd, &mut sum, &a[from..from + V], &b[first..first + N]);
            }
        }
        Factors::Columns { strips } => {
            let strips = &strips[..N * T::SLAB];
            for (l, a) in a.chunks_exact(strip).enumerate().take(T::SLAB) {
                let mut b = [T::ZERO; N];
                for j in 0..N {
                    b[j] = strips[j * T::SLAB + l];
                }
                add::<S, T, N, V>(simd, &mut sum, &a[from..from + V], &b);
            }
        }
        Factors::One { values } => {
            for (a, b) in a.chunks_exact(strip).zip(values) {
                add::<S, T, N, V>(simd, &mut sum, &a[from..from + V], &[*b; N]);
            }
        }
    }
    for (into, sum) in into.chunks_exact_mut(strip).zip(sum) {
        for (into, sum) in into[from..from + V].iter_mut().zip(sum) {
            let there = if onto == Onto::There { *into } else { zero };
            *into = T::sub(simd, there, sum);
        }
    }
    V
}

/// One strip of A times one row of B onto the sums.
#[inline(always)]
fn add<S: Simd, T: Real, const N: usize, const V: usize>(
    simd: S,
    sum: &mut [[T::Vector<S>; V]; N],
    a: &[T::Vector<S>],
    b: &[T],
) {
    for j in 0..N {
        let factor = T::splat(simd, b[j]);
        for v in 0..V {
            sum[j][v] = T::mul_add(simd, a[v], factor, sum[j][v]);
        }
    }
}

/// `X ← X L⁻ᵀ` in place: columns of a factor below its square on the diagonal, or right-hand sides.
///
/// Shapes: `x` `columns` strips of `width` numbers; `square` `columns` strips of [`Real::SLAB`]
/// numbers, of which those below the diagonal are read; `inverses` of its diagonal.
#[inline(always)]
pub(super) fn divide_by_square<S: Simd, T: Real>(
    simd: S,
    x: &mut [T],
    square: &[T],
    inverses: &[T],
    width: usize,
    columns: usize,
) {
    let lanes = size_of::<T::Vector<S>>() / size_of::<T>();
    let strip = width / lanes;
    let step = columns_at_once::<S>();
    let mut from = 0;
    while from < columns {
        let to = columns.min(from + step);
        let (done, now) = x.split_at_mut(from * width);
        let b = Factors::Rows { strips: &square[..from * T::SLAB], first: from };
        if from > 0 {
            subtract_product(simd, (&mut *now, Onto::There), done, b, width, to - from);
        }
        let now = T::vectors_mut::<S>(&mut now[..(to - from) * width]);
        for j in from..to {
            let (before, own) = now.split_at_mut((j - from) * strip);
            let own = &mut own[..strip];
            for (l, before) in before.chunks_exact(strip).enumerate() {
                let factor = T::splat(simd, -square[(from + l) * T::SLAB + j]);
                for (own, before) in own.iter_mut().zip(before) {
                    *own = T::mul_add(simd, *before, factor, *own);
                }
            }
            let inverse = T::splat(simd, inverses[j]);
            for own in own {
                *own = T::mul_add(simd, *own, inverse, T::splat(simd, T::ZERO));
            }
        }
        from = to;
    }
}

/// Cholesky factor of a square on the diagonal in place, and the inverses of its pivots; `Err` is
/// the failing pivot.
///
/// Shapes: `square` `columns` strips of [`Real::SLAB`] numbers, lower triangle.
#[inline(always)]
pub(super) fn factor_square<S: Simd, T: Real>(
    simd: S,
    square: &mut [T],
    inverses: &mut [T],
    columns: usize,
) -> Result<(), usize> {
    let step = columns_at_once::<S>();
    let mut from = 0;
    while from < columns {
        let to = columns.min(from + step);
        if from > 0 {
            let (done, now) = square.split_at_mut(from * T::SLAB);
            let b = Factors::Rows { strips: done, first: from };
            subtract_product(simd, (now, Onto::There), done, b, T::SLAB, to - from);
        }
        for j in from..to {
            let (own, after) = square[j * T::SLAB..to * T::SLAB].split_at_mut(T::SLAB);
            if !own[j].is_pivot() {
                return Err(j);
            }
            let root = own[j].root();
            inverses[j] = T::ONE / root;
            own.iter_mut().for_each(|x| *x = *x * inverses[j]);
            own[j] = root;
            for (l, after) in after.chunks_exact_mut(T::SLAB).enumerate() {
                let factor = own[j + 1 + l];
                after.iter_mut().zip(&*own).for_each(|(x, &own)| *x -= own * factor);
            }
        }
        from = to;
    }
    Ok(())
}

/// `x_j −= a_j · y` for the columns of a slab and one right-hand side.
///
/// Shapes: `a` one strip of [`Real::SLAB`] numbers for each of `x`; `y` one strip.
#[inline(always)]
pub(super) fn subtract_dots<S: Simd, T: Real>(simd: S, x: &mut [T], a: &[T], y: &[T]) {
    let lanes = size_of::<T::Vector<S>>() / size_of::<T>();
    let (strip, y) = (T::SLAB / lanes, T::vectors::<S>(y));
    for (x, a) in x.iter_mut().zip(T::vectors::<S>(a).chunks_exact(strip)) {
        let mut sum = T::splat(simd, T::ZERO);
        for v in 0..strip {
            sum = T::mul_add(simd, a[v], y[v], sum);
        }
        *x -= T::sum(simd, sum);
    }
}
