//! Mends the tetrahedra of a file that cannot be used as they are, and lists what that changes.

use crate::mesh::{Bodies, TetMesh};

/// What is wrong with a tetrahedron of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TetFault {
    /// Its corners are ordered against the format's rule; it is turned.
    Inverted,
    /// It has no volume; it is dropped.
    Flat,
    /// It has the four corners of an earlier one; it is dropped.
    Repeated {
        /// Record number of the earlier one, from 0.
        of: usize,
    },
}

/// One tetrahedron that cannot be used as it stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BadTet {
    /// Record number in the file, from 0.
    pub tet: usize,
    /// What is wrong.
    pub fault: TetFault,
    /// Volume as the file orders the corners: negative where inverted.
    pub volume: f64,
}

/// All that is put right in a file's tetrahedra, and how that changes the object.
///
/// Units: volumes in the file's unit of length, cubed.
#[derive(Clone, Debug, PartialEq)]
pub struct Mending {
    /// Ascending by record number.
    pub bad: Vec<BadTet>,
    /// Sum of the volumes as the file orders and repeats its tetrahedra.
    pub volume_in_file: f64,
    /// Volume of the mended mesh.
    pub volume: f64,
    /// Nodes all of whose tetrahedra were dropped, ascending; they stay as orphans.
    pub lost_nodes: Vec<u32>,
    /// Bodies (joined by nodes) of the file's tetrahedra, dropped ones included.
    pub bodies_in_file: usize,
    /// Bodies of the mended mesh.
    pub bodies: usize,
    /// Bodies of the file that come apart, each as the number of bodies it becomes, 2 or more.
    pub fallen_apart: Vec<usize>,
    /// Bodies of the file of which nothing is left.
    pub vanished: usize,
    /// Pieces (joined by faces) of the file's tetrahedra; fewer than bodies is impossible.
    pub pieces_in_file: usize,
    /// Pieces of the mended mesh: more than before means new hinges or new bodies.
    pub pieces: usize,
}

impl TetFault {
    /// The fault in a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Inverted => "inverted",
            Self::Flat => "flat",
            Self::Repeated { .. } => "repeated",
        }
    }

    /// What is done about it.
    pub fn action(self) -> &'static str {
        match self {
            Self::Inverted => "turn",
            Self::Flat | Self::Repeated { .. } => "drop",
        }
    }

    /// Whether the tetrahedron is not in the mended mesh.
    pub fn is_dropped(self) -> bool {
        !matches!(self, Self::Inverted)
    }
}

impl Mending {
    /// What mending changed; `None` if there was nothing to mend.
    ///
    /// Shapes: `all` corner indices of the file's tetrahedra, all below the node count of `mesh`;
    /// `kept` the record number of each of the mesh's. `bad` ascending.
    pub(super) fn new(
        bad: Vec<BadTet>,
        volume_in_file: f64,
        all: &[[u32; 4]],
        kept: &[usize],
        mesh: &TetMesh,
    ) -> Option<Self> {
        if bad.is_empty() {
            return None;
        }
        let volume = (0..mesh.tets().len()).map(|tet| mesh.signed_volume(tet)).sum();
        let mut mending = Self {
            bad,
            volume_in_file,
            volume,
            lost_nodes: Vec::new(),
            bodies_in_file: 0,
            bodies: 0,
            fallen_apart: Vec::new(),
            vanished: 0,
            pieces_in_file: 0,
            pieces: 0,
        };
        let after = Bodies::from_mesh(mesh);
        (mending.bodies, mending.pieces) = (after.count(), after.piece_count());
        if !mending.bad.iter().any(|bad| bad.fault.is_dropped()) {
            (mending.bodies_in_file, mending.pieces_in_file) = (mending.bodies, mending.pieces);
            return Some(mending);
        }
        let before = Bodies::from_tets(mesh.node_count(), all);
        (mending.bodies_in_file, mending.pieces_in_file) = (before.count(), before.piece_count());
        let nodes = before.of_node.iter().zip(&after.of_node).zip(0u32..);
        mending.lost_nodes = nodes
            .filter(|((before, after), _)| before.is_some() && after.is_none())
            .map(|(_, node)| node)
            .collect();
        // Which body of the file each body of the mesh was part of.
        let mut parts = vec![0; before.count()];
        let mut seen = vec![false; after.count()];
        for (&record, &body) in kept.iter().zip(&after.of_tet) {
            if !std::mem::replace(&mut seen[body as usize], true) {
                parts[before.of_tet[record] as usize] += 1;
            }
        }
        mending.vanished = parts.iter().filter(|&&parts| parts == 0).count();
        mending.fallen_apart = parts.into_iter().filter(|&parts| parts > 1).collect();
        Some(mending)
    }

    /// How many have a fault of this kind, whichever tetrahedron they repeat.
    pub fn count(&self, name: &str) -> usize {
        self.bad.iter().filter(|bad| bad.fault.name() == name).count()
    }
}

/// Record numbers of tetrahedra that repeat an earlier one, with the earlier one's, ascending.
///
/// Shapes: `all` corner indices of the file's tetrahedra, `records` those to look at, ascending.
pub(super) fn repeated(
    all: &[[u32; 4]],
    records: impl Iterator<Item = usize>,
) -> Vec<(usize, usize)> {
    let mut sorted: Vec<([u32; 4], usize)> = records
        .map(|record| {
            let mut corners = all[record];
            corners.sort_unstable();
            (corners, record)
        })
        .collect();
    sorted.sort_unstable();
    let mut repeated = Vec::new();
    for same in sorted.chunk_by(|a, b| a.0 == b.0) {
        if let [(_, first), rest @ ..] = same {
            repeated.extend(rest.iter().map(|&(_, record)| (record, *first)));
        }
    }
    repeated.sort_unstable();
    repeated
}
