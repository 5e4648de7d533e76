//! Numbers in memory that begins where a cache line does.

use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

use bytemuck::{Pod, Zeroable};

use super::Real;

/// One cache line, and one vector of 512 bits.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C, align(64))]
struct Line([f64; 8]);

/// A list of numbers that begins where a cache line does.
///
/// Shapes: it holds at least as many as were asked for, rounded up to whole lines.
pub(super) struct Lines<T> {
    lines: Vec<Line>,
    numbers: PhantomData<T>,
}

impl<T> Default for Lines<T> {
    fn default() -> Self {
        Self { lines: Vec::new(), numbers: PhantomData }
    }
}

impl<T: Real> Lines<T> {
    /// Zeros; the system clears the memory when it is first touched.
    pub fn zeros(len: usize) -> Self {
        Self { lines: bytemuck::zeroed_vec(count::<T>(len)), numbers: PhantomData }
    }

    /// Gives the memory behind so many numbers back to the system.
    pub fn shorten(&mut self, len: usize) {
        self.lines.truncate(count::<T>(len));
        self.lines.shrink_to_fit();
    }
}

/// Lines that so many numbers take.
fn count<T>(len: usize) -> usize {
    (len * size_of::<T>()).div_ceil(size_of::<Line>())
}

impl<T: Real> Deref for Lines<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        bytemuck::cast_slice(&self.lines)
    }
}

impl<T: Real> DerefMut for Lines<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        bytemuck::cast_slice_mut(&mut self.lines)
    }
}
