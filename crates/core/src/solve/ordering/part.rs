//! A part of a graph with the places of its vertices, and how a separator divides it.

/// A graph in its own numbering.
///
/// Shapes: n vertices; those that vertex v shares an edge with are
/// `neighbours[start[v] .. start[v + 1]]`. Vertex v is `vertices[v]` of the whole graph and lies at
/// `places[v]`.
pub(super) struct Part {
    pub vertices: Vec<u32>,
    pub start: Vec<u32>,
    pub neighbours: Vec<u32>,
    pub places: Vec<[f32; 3]>,
}

/// On which side of a separator a vertex is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Left,
    Right,
    /// In the separator: its neighbours may be on both sides.
    Between,
}

/// A separator and the number of vertices on its sides.
pub(super) struct Separated {
    pub sides: Vec<Side>,
    pub left: usize,
    pub right: usize,
}

impl Separated {
    /// Shapes: `sides` one for each vertex of a part.
    pub fn count(sides: Vec<Side>) -> Self {
        let count = |wanted: Side| sides.iter().filter(|&&side| side == wanted).count();
        let (left, right) = (count(Side::Left), count(Side::Right));
        Self { sides, left, right }
    }
}

impl Part {
    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.vertices.len()
    }

    pub fn neighbours(&self, v: usize) -> &[u32] {
        &self.neighbours[self.start[v] as usize..self.start[v + 1] as usize]
    }

    /// The vertices of both sides and the edges among them; takes the part's own memory back.
    ///
    /// Shapes: `sides` one for each vertex.
    pub fn split(self, sides: &[Side]) -> [Self; 2] {
        let mut number = vec![0; self.len()];
        [Side::Left, Side::Right].map(|side| self.of_side(sides, side, &mut number))
    }

    /// Shapes: `number` one for each vertex, overwritten.
    fn of_side(&self, sides: &[Side], side: Side, number: &mut [u32]) -> Self {
        let kept: Vec<usize> = (0..self.len()).filter(|&v| sides[v] == side).collect();
        for (new, &v) in kept.iter().enumerate() {
            number[v] = new as u32;
        }
        let mut start = Vec::with_capacity(kept.len() + 1);
        start.push(0);
        let mut neighbours = Vec::with_capacity(self.neighbours.len() * kept.len() / self.len());
        for &v in &kept {
            let inside = self.neighbours(v).iter().filter(|&&w| sides[w as usize] == side);
            neighbours.extend(inside.map(|&w| number[w as usize]));
            start.push(neighbours.len() as u32);
        }
        let vertices = kept.iter().map(|&v| self.vertices[v]).collect();
        let places = kept.iter().map(|&v| self.places[v]).collect();
        Self { vertices, start, neighbours, places }
    }
}
