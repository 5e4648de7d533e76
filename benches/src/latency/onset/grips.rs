//! Random sets of touched nodes, some of which have never been touched before.

use softgrasp_protocol::DofValue;

/// Touched nodes of one grip, and those of them that are new to the server.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Grip {
    /// All touched nodes, ascending.
    pub nodes: Vec<u32>,
    /// Nodes that no earlier request named.
    pub fresh: Vec<u32>,
    /// Displacement of every touched degree of freedom, ascending, m.
    pub known: Vec<DofValue>,
}

/// Number of fingertips.
pub(super) const TOUCHED: usize = 5;
/// Number of nodes used last from which those beside a new node are drawn: their columns are still kept.
const RECENT: usize = 200;

/// Draws grips from the surface of one object; no new node occurs twice.
pub(super) struct Grips {
    random: SplitMix,
    untouched: Vec<u32>,
    touched: Vec<u32>,
    /// Largest displacement along an axis, m.
    reach: f64,
}

impl Grips {
    /// Grips of the surface nodes of an object.
    pub fn new(surface: &[u32], reach: f64, seed: u64) -> Self {
        let mut random = SplitMix(seed);
        let mut untouched = surface.to_vec();
        // Fisher and Yates.
        for last in (1..untouched.len()).rev() {
            untouched.swap(last, random.below(last + 1));
        }
        Self { random, untouched, touched: Vec::new(), reach }
    }

    /// Grip of five nodes, `fresh_count` of them new; `None` when the surface is used up.
    pub fn draw(&mut self, fresh_count: usize) -> Option<Grip> {
        let companions = TOUCHED.saturating_sub(fresh_count);
        if self.untouched.len() < fresh_count || self.touched.len() < companions {
            return None;
        }
        let fresh = self.untouched.split_off(self.untouched.len() - fresh_count);
        let recent = self.touched.len().saturating_sub(RECENT);
        let mut nodes = fresh.clone();
        while nodes.len() < TOUCHED.max(fresh_count) {
            let at = recent + self.random.below(self.touched.len() - recent);
            if !nodes.contains(&self.touched[at]) {
                nodes.push(self.touched[at]);
            }
        }
        self.touched.extend(&fresh);
        nodes.sort_unstable();
        let dofs = nodes.iter().flat_map(|n| 3 * n..3 * n + 3);
        let known = dofs
            .map(|dof| DofValue { dof, value: self.reach * (2.0 * self.random.share() - 1.0) })
            .collect();
        Some(Grip { nodes, fresh, known })
    }
}

/// Random numbers that are the same on every machine.
///
/// Source: Steele, Lea, Flood, Fast splittable pseudorandom number generators, OOPSLA 2014.
struct SplitMix(u64);

impl SplitMix {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Random number in 0 … 1, without 1.
    fn share(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Random number in 0 … n − 1, for n ≥ 1.
    fn below(&mut self, n: usize) -> usize {
        ((self.share() * n as f64) as usize).min(n.saturating_sub(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn fresh_nodes_are_fresh_and_companions_are_not() {
        let surface: Vec<u32> = (100..160).collect();
        let mut grips = Grips::new(&surface, 0.01, 7);
        let mut seen = BTreeSet::new();
        assert_eq!(grips.draw(1), None, "there are no companions yet");
        let mut counts = [5, 1, 5, 1, 1].into_iter().cycle();
        while let Some(grip) = counts.next().and_then(|fresh| grips.draw(fresh)) {
            assert_eq!((grip.nodes.len(), grip.known.len()), (5, 15));
            assert!(grip.nodes.windows(2).all(|w| w[0] < w[1]));
            assert!(grip.known.windows(2).all(|w| w[0].dof < w[1].dof));
            assert!(grip.known.iter().all(|k| k.value.abs() <= 0.01));
            for node in &grip.nodes {
                assert_eq!(grip.fresh.contains(node), !seen.contains(node), "{node}");
            }
            seen.extend(grip.nodes.iter().copied());
        }
        assert!(seen.len() > 50 && seen.iter().all(|n| surface.contains(n)));
    }

    #[test]
    fn equal_seeds_draw_equal_grips() {
        let surface: Vec<u32> = (0..40).collect();
        let draw = |seed| Grips::new(&surface, 1.0, seed).draw(5);
        assert_eq!(draw(1), draw(1));
        assert_ne!(draw(1), draw(2));
    }
}
