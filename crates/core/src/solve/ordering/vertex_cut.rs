//! The smallest separator near one that is there, found as a flow through a band of vertices.

use std::collections::VecDeque;

use super::part::{Part, Separated, Side};

/// No vertex of a band.
const NONE: u32 = u32::MAX;
/// Layers of a band on both sides of the separator.
const BAND_LAYERS: usize = 1;

/// Vertices near a separator, between the rest of both sides.
struct Band {
    /// Vertices of the part.
    vertices: Vec<u32>,
    /// Where a vertex of the part is in the band, or [`NONE`].
    index: Vec<u32>,
    /// Whether a vertex has a neighbour in the rest of the one side, the source of the flow.
    is_source: Vec<bool>,
    /// Whether a vertex has a neighbour in the rest of the other side, the sink of the flow.
    is_sink: Vec<bool>,
}

/// A separator of at most as many vertices, all of them near one that is there; `None` where a side
/// is no more than what is near.
///
/// Source: Menger's theorem; the idea to refine separators by flows is that of Ashcraft and Liu,
/// "Applications of the Dulmage–Mendelsohn decomposition and network flow to graph bisection
/// improvement" (1998).
pub(super) fn smallest_near(part: &Part, now: &Separated) -> Option<Separated> {
    // The smallest that lies nearest to the source is found: the larger side gives way.
    let (source, sink) = match now.left >= now.right {
        true => (Side::Left, Side::Right),
        false => (Side::Right, Side::Left),
    };
    let band = Band::around(part, now, source, sink)?;
    let mut flow = Flow::new(part, &band);
    while flow.find_levels() {
        flow.augment();
    }
    let mut sides = now.sides.clone();
    for (k, &v) in band.vertices.iter().enumerate() {
        // What the source still reaches is on its side.
        sides[v as usize] = match (flow.is_reached(2 * k), flow.is_reached(2 * k + 1)) {
            (_, true) => source,
            (true, false) => Side::Between,
            (false, false) => sink,
        };
    }
    Some(Separated::count(sides))
}

impl Band {
    /// The separator and the layers next to it; `None` where nothing is left beyond.
    fn around(part: &Part, now: &Separated, source: Side, sink: Side) -> Option<Self> {
        let mut index = vec![NONE; part.len()];
        let mut vertices: Vec<u32> =
            (0..part.len() as u32).filter(|&v| now.sides[v as usize] == Side::Between).collect();
        for (k, &v) in vertices.iter().enumerate() {
            index[v as usize] = k as u32;
        }
        let between = vertices.len();
        for side in [source, sink] {
            let mut layer = 0..between;
            for _ in 0..BAND_LAYERS {
                let end = vertices.len();
                for k in layer {
                    for &w in part.neighbours(vertices[k] as usize) {
                        if now.sides[w as usize] == side && index[w as usize] == NONE {
                            index[w as usize] = vertices.len() as u32;
                            vertices.push(w);
                        }
                    }
                }
                layer = end..vertices.len();
            }
        }
        let touches = |v: u32, side: Side| {
            let mut others = part.neighbours(v as usize).iter();
            others.any(|&w| index[w as usize] == NONE && now.sides[w as usize] == side)
        };
        let is_source: Vec<bool> = vertices.iter().map(|&v| touches(v, source)).collect();
        let is_sink: Vec<bool> = vertices.iter().map(|&v| touches(v, sink)).collect();
        let has_both = is_source.contains(&true) && is_sink.contains(&true);
        has_both.then_some(Self { vertices, index, is_source, is_sink })
    }
}

/// Flow with room for one unit in each vertex of a band.
///
/// Vertex k has the states 2k (entered) and 2k + 1 (left); a unit that has entered a vertex another
/// one passes through pushes that one back to where it comes from.
///
/// Source: Dinic, "Algorithm for solution of a problem of maximum flow" (1970), on split vertices.
struct Flow<'a> {
    band: &'a Band,
    start: Vec<u32>,
    neighbours: Vec<u32>,
    is_used: Vec<bool>,
    /// Where the unit through a vertex comes from, or [`NONE`] for the source.
    previous: Vec<u32>,
    /// Distance of each state from the source, or [`NONE`].
    levels: Vec<u32>,
    /// How many ways on from a state were tried; [`NONE`] where none is left.
    tried: Vec<u32>,
}

impl<'a> Flow<'a> {
    fn new(part: &Part, band: &'a Band) -> Self {
        let count = band.vertices.len();
        let mut start = vec![0];
        let mut neighbours = Vec::new();
        for &v in &band.vertices {
            let inside = part.neighbours(v as usize).iter().map(|&w| band.index[w as usize]);
            neighbours.extend(inside.filter(|&k| k != NONE));
            start.push(neighbours.len() as u32);
        }
        Self {
            band,
            start,
            neighbours,
            is_used: vec![false; count],
            previous: vec![NONE; count],
            levels: Vec::new(),
            tried: Vec::new(),
        }
    }

    /// The k-th state that flow can go on to.
    fn next(&self, state: usize, k: usize) -> Option<usize> {
        let v = state / 2;
        if state.is_multiple_of(2) {
            return match (k, self.is_used[v], self.previous[v]) {
                (0, false, _) => Some(2 * v + 1),
                (0, true, previous) if previous != NONE => Some(2 * previous as usize + 1),
                _ => None,
            };
        }
        let own = self.start[v] as usize..self.start[v + 1] as usize;
        match self.neighbours[own.clone()].get(k) {
            Some(&w) => Some(2 * w as usize),
            None if k == own.len() && self.is_used[v] => Some(2 * v),
            None => None,
        }
    }

    /// Distances of the states from the source; whether the sink is reached.
    fn find_levels(&mut self) -> bool {
        let count = self.band.vertices.len();
        self.levels.clear();
        self.levels.resize(2 * count, NONE);
        self.tried.clear();
        self.tried.resize(2 * count, 0);
        let mut queue = VecDeque::new();
        for k in 0..count {
            if self.band.is_source[k] {
                self.levels[2 * k] = 0;
                queue.push_back(2 * k);
            }
        }
        let mut is_reached = false;
        while let Some(state) = queue.pop_front() {
            is_reached |= state % 2 == 1 && self.band.is_sink[state / 2];
            let mut k = 0;
            while let Some(next) = self.next(state, k) {
                if self.levels[next] == NONE {
                    self.levels[next] = self.levels[state] + 1;
                    queue.push_back(next);
                }
                k += 1;
            }
        }
        is_reached
    }

    fn is_reached(&self, state: usize) -> bool {
        self.levels[state] != NONE
    }

    /// Sends flow along shortest paths until none is left.
    fn augment(&mut self) {
        let mut path: Vec<usize> = Vec::new();
        for k in 0..self.band.vertices.len() {
            let is_begun = self.is_used[k] && self.previous[k] == NONE;
            if !self.band.is_source[k] || is_begun {
                continue;
            }
            path.clear();
            path.push(2 * k);
            if self.extend(&mut path) {
                self.send(&path);
            }
        }
    }

    /// Goes on to the sink from the first state of a path; whether it gets there.
    fn extend(&mut self, path: &mut Vec<usize>) -> bool {
        while let Some(&state) = path.last() {
            if state % 2 == 1 && self.band.is_sink[state / 2] {
                return true;
            }
            match self.next(state, self.tried[state] as usize) {
                Some(next) => {
                    self.tried[state] += 1;
                    if self.levels[next] == self.levels[state] + 1 && self.tried[next] != NONE {
                        path.push(next);
                    }
                }
                None => {
                    self.tried[state] = NONE;
                    path.pop();
                }
            }
        }
        false
    }

    /// Sends one unit of flow along a path.
    fn send(&mut self, path: &[usize]) {
        self.previous[path[0] / 2] = NONE;
        for pair in path.windows(2) {
            let (from, to) = (pair[0] / 2, pair[1] / 2);
            match (pair[0] % 2, from == to) {
                (1, false) => self.previous[to] = from as u32,
                (1, true) => self.is_used[from] = false,
                (_, true) => self.is_used[from] = true,
                _ => {}
            }
        }
        // No later path of this level passes these states.
        for &state in path {
            self.tried[state] = NONE;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Whether no path leads from the source to the sink past the vertices of a set.
    fn separates(edges: &[(usize, usize)], ends: &[(bool, bool)], cut: u32) -> bool {
        let is_open = |v: usize| cut & (1 << v) == 0;
        let mut reached: Vec<bool> =
            ends.iter().enumerate().map(|(v, end)| end.0 && is_open(v)).collect();
        for _ in 0..ends.len() {
            for &(a, b) in edges {
                for (from, to) in [(a, b), (b, a)] {
                    reached[to] |= reached[from] && is_open(to);
                }
            }
        }
        !ends.iter().zip(reached).any(|(end, reached)| end.1 && reached)
    }

    proptest! {
        #[test]
        fn flow_is_as_large_as_the_smallest_of_all_cuts(
            ends in proptest::collection::vec((any::<bool>(), any::<bool>()), 2..10),
            edges in proptest::collection::vec((0usize..10, 0usize..10), 0..30),
        ) {
            let count = ends.len();
            let edges: Vec<_> = edges
                .into_iter()
                .map(|(a, b)| (a % count, b % count))
                .filter(|(a, b)| a != b)
                .collect();
            let mut start = vec![0];
            let mut neighbours = Vec::new();
            for v in 0..count {
                let of = |&(a, b): &(usize, usize)| match v {
                    _ if a == v => Some(b as u32),
                    _ if b == v => Some(a as u32),
                    _ => None,
                };
                neighbours.extend(edges.iter().filter_map(of));
                start.push(neighbours.len() as u32);
            }
            let vertices: Vec<u32> = (0..count as u32).collect();
            let places = vec![[0.0; 3]; count];
            let part = Part { vertices: vertices.clone(), start, neighbours, places };
            let band = Band {
                index: vertices.clone(),
                vertices,
                is_source: ends.iter().map(|end| end.0).collect(),
                is_sink: ends.iter().map(|end| end.1).collect(),
            };
            let mut flow = Flow::new(&part, &band);
            while flow.find_levels() {
                flow.augment();
            }
            let found: u32 = (0..count)
                .filter(|&k| flow.is_reached(2 * k) && !flow.is_reached(2 * k + 1))
                .map(|k| 1 << k)
                .sum();
            prop_assert!(separates(&edges, &ends, found), "{found:b} is no cut");
            let smallest = (0u32..1 << count)
                .filter(|&cut| separates(&edges, &ends, cut))
                .map(u32::count_ones)
                .min();
            prop_assert_eq!(Some(found.count_ones()), smallest);
        }
    }
}
