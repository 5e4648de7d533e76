//! Memory of panels and contribution blocks: large ones in huge pages, which take a hundredth of
//! the time to be had.

use std::ops::{Deref, DerefMut};

use memmap2::{MmapMut, MmapOptions};

use super::Real;

/// Numbers that were zero at first.
pub(super) enum Values<T> {
    Small(Vec<T>),
    /// Exactly as many bytes as the numbers take.
    Large(MmapMut),
}

/// Of this size on memory is taken in pages of 2 MiB, if the system has any.
const LARGE_BYTES: usize = 4 << 20;

impl<T: Real> Values<T> {
    /// So many zeros, each page of them zeroed when it is first touched, by the thread that does.
    pub fn zeroed(len: usize) -> Self {
        let bytes = len.saturating_mul(size_of::<T>());
        if bytes < LARGE_BYTES {
            return Self::Small(vec![T::ZERO; len]);
        }
        match MmapOptions::new().len(bytes).map_anon() {
            Ok(map) => {
                #[cfg(target_os = "linux")]
                // Without huge pages it is as good, only slower.
                let _ = map.advise(memmap2::Advice::HugePage);
                Self::Large(map)
            }
            Err(_) => Self::Small(vec![T::ZERO; len]),
        }
    }

    /// Makes it hold `len` zeros, in the memory it has if that fits.
    pub fn reset(&mut self, len: usize) {
        match self.len() == len {
            true => self.fill(T::ZERO),
            false => *self = Self::zeroed(len),
        }
    }
}

impl<T> Default for Values<T> {
    fn default() -> Self {
        Self::Small(Vec::new())
    }
}

impl<T: Real> Deref for Values<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        match self {
            Self::Small(values) => values,
            Self::Large(map) => bytemuck::cast_slice(map),
        }
    }
}

impl<T: Real> DerefMut for Values<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        match self {
            Self::Small(values) => values,
            Self::Large(map) => bytemuck::cast_slice_mut(map),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_and_small_values_are_zeros_of_the_length_asked_for() {
        for len in [0, 1, 1000, (LARGE_BYTES >> 3) - 1, LARGE_BYTES >> 3, 1_300_001] {
            let mut values = Values::<f64>::zeroed(len);
            assert_eq!(values.len(), len);
            assert!(values.iter().all(|&x| x == 0.0));
            values.fill(2.0);
            assert!(values.iter().all(|&x| x == 2.0));
            values.reset(len);
            assert!(values.len() == len && values.iter().all(|&x| x == 0.0));
            values.fill(2.0);
            values.reset(len / 2);
            assert!(values.len() == len / 2 && values.iter().all(|&x| x == 0.0));
        }
    }
}
