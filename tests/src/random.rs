//! Random numbers with a printed seed that the environment variable `SEED` sets.

/// Splitmix64: the same numbers for the same seed on every machine.
#[derive(Clone, Debug)]
pub struct Random(u64);

const USUAL_SEED: u64 = 1998;

impl Random {
    /// Source for one test; prints its seed, so that a failure can be repeated.
    ///
    /// # Panics
    /// If `SEED` is set to a text that is no number.
    pub fn from_environment(test: &str) -> Self {
        let seed = match std::env::var("SEED") {
            Ok(text) => text.parse().expect("SEED must be a whole number"),
            Err(_) => USUAL_SEED,
        };
        eprintln!("{test}: SEED={seed}");
        Self(seed)
    }

    /// Source with a seed of its own.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Random number of 64 bits.
    pub fn number(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Random number below `end`; 0 if `end` is 0.
    pub fn below(&mut self, end: usize) -> usize {
        (self.number() % (end.max(1) as u64)) as usize
    }

    /// Random bytes.
    pub fn bytes(&mut self, len: usize) -> Vec<u8> {
        (0..len).map(|_| self.number() as u8).collect()
    }
}
