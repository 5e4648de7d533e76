//! Chance that is the same in every run: which records a fault hits, and how.

/// Random numbers (splitmix64), the same for the same seed on every machine.
#[derive(Clone, Debug)]
pub(super) struct Chance(u64);

impl Chance {
    pub(super) const fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A random number from 0 up to, but without, 1.
    pub(super) fn share(&mut self) -> f64 {
        // 53 bits fill the mantissa.
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A random number from 0 up to, but without, `count`; 0 where `count` is 0.
    pub(super) fn below(&mut self, count: usize) -> usize {
        (self.share() * count as f64) as usize
    }

    pub(super) fn byte(&mut self) -> u8 {
        self.next() as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stay_in_range_and_come_again_for_the_same_seed() {
        let mut chance = Chance::new(7);
        let mut again = Chance::new(7);
        let mut sum = 0.0;
        for _ in 0..1000 {
            let share = chance.share();
            assert_eq!(share, again.share());
            assert!((0.0..1.0).contains(&share));
            sum += share;
            assert!(chance.below(3) < 3);
            let _ = again.below(3);
        }
        assert!((400.0..600.0).contains(&sum));
        assert_eq!(chance.below(0), 0);
    }
}
