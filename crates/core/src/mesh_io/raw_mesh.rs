//! The data that a reader collects, and the one place where a checked mesh is made of them.

use std::collections::BTreeMap;

use nalgebra::Point3;

use super::cell_kind::{CellKind, Shape};
use super::error::{Fault, MeshFileError};
use super::labels::NodeLabels;
use super::mending::repeated;
use crate::mesh::{MeshError, TetMesh, mirrored, mirrored_middles};
use crate::mesh_io::{BadTet, Findings, Format, Mending, MeshFile, TetFault};

/// A volume below this fraction of the cube of the longest edge is rounding, not volume.
const DEGENERATE: f64 = 1e-14;

/// Tetrahedra that can be modelled, their record numbers, and those that could not as they stood.
struct Sound {
    tets: Vec<[u32; 4]>,
    kept: Vec<usize>,
    /// Whether each was turned.
    turned: Vec<bool>,
    /// Tetrahedra that were put right or dropped, ascending by record number.
    bad: Vec<BadTet>,
    volume_in_file: f64,
}

/// What a reader collects from a file, labels and all.
#[derive(Debug, Default)]
pub(super) struct RawMesh {
    /// Node coordinates in file order.
    pub(super) points: Vec<Point3<f64>>,
    /// Label of each node; empty when the nodes are numbered from `first_label` without gaps.
    pub(super) node_labels: Vec<i64>,
    /// Label of the first node when `node_labels` is empty.
    pub(super) first_label: i64,
    /// Corner labels of each tetrahedron in file order.
    pub(super) tets: Vec<[i64; 4]>,
    /// Labels of the mid-edge nodes of each tetrahedron, of the edges 12, 23, 13, 14, 24, 34; shorter than
    /// `tets` where some tetrahedra have none or further nodes.
    pub(super) mid_edge: Vec<[i64; 6]>,
    /// Two candidates for the region of each tetrahedron; the second counts when the first is 0
    /// everywhere (Gmsh: physical group, then geometric entity).
    pub(super) regions: Vec<[i64; 2]>,
    /// Names of regions, for the first candidate.
    pub(super) region_names: BTreeMap<i64, String>,
    /// Cells that are not tetrahedra.
    pub(super) other_cells: BTreeMap<CellKind, usize>,
    /// File with the tetrahedra where that is not the file that was given (TetGen).
    pub(super) tets_file: Option<String>,
    /// Everything worth telling that is known while reading.
    pub(super) findings: Findings,
}

impl RawMesh {
    /// Adds a cell: a tetrahedron by its corners, with its mid-edge nodes if it has ten nodes in the order
    /// of VTK and Abaqus (edges 12, 23, 13, 14, 24, 34); anything else as a count.
    pub(super) fn add_cell(&mut self, kind: CellKind, nodes: &[i64], region: [i64; 2]) {
        match (kind.shape, nodes) {
            (Shape::Tetrahedron, &[a, b, c, d, ref further @ ..]) => {
                self.add_tet([a, b, c, d], further);
                self.regions.push(region);
            }
            _ => self.count_cells(kind, 1),
        }
    }

    /// [`RawMesh::add_cell`] in the order of Gmsh, which has edges 34 and 24 last.
    pub(super) fn add_gmsh_cell(&mut self, kind: CellKind, nodes: &[i64], region: [i64; 2]) {
        match (kind.shape, nodes) {
            (Shape::Tetrahedron, &[a, b, c, d, e12, e23, e13, e14, e34, e24]) => {
                self.add_cell(kind, &[a, b, c, d, e12, e23, e13, e14, e24, e34], region);
            }
            _ => self.add_cell(kind, nodes, region),
        }
    }

    /// Adds a tetrahedron without a region: corners, and the nodes behind them in the order of VTK.
    pub(super) fn add_tet(&mut self, corners: [i64; 4], further: &[i64]) {
        if let Ok(middles) = further.try_into()
            && self.mid_edge.len() == self.tets.len()
        {
            self.mid_edge.push(middles);
        }
        self.tets.push(corners);
        self.findings.higher_order += usize::from(!further.is_empty());
    }

    /// Adds cells that are not tetrahedra to the count of their kind.
    pub(super) fn count_cells(&mut self, kind: CellKind, count: usize) {
        *self.other_cells.entry(kind).or_default() += count;
    }

    /// Maps labels, turns inverted tetrahedra, drops flat and repeated ones, numbers the regions.
    ///
    /// # Errors
    /// [`MeshFileError`] for file `name`: labels that fit nothing, or no tetrahedra left.
    pub(super) fn finish(mut self, name: &str, format: Format) -> Result<MeshFile, MeshFileError> {
        let refuse = |fault: Fault| MeshFileError { file: name.to_owned(), fault };
        for (kind, count) in &self.other_cells {
            *self.findings.other_cells.entry(kind.to_string()).or_default() += count;
        }
        self.findings.file_nodes = self.points.len();
        self.findings.file_tets = self.tets.len();
        if self.tets.is_empty() {
            return Err(refuse(self.nothing_to_model()));
        }
        if self.points.len() >= u32::MAX as usize {
            return Err(refuse(Fault::Count {
                at: super::error::Place::Line(1),
                array: "nodes".to_owned(),
                expected: format!("fewer than {}", u32::MAX),
                found: self.points.len().to_string(),
            }));
        }
        if let Some(node) = self.points.iter().position(|p| !p.coords.iter().all(|c| c.is_finite()))
        {
            return Err(refuse(Fault::Mesh(MeshError::NotFinite { node })));
        }
        let labels = match self.node_labels.as_slice() {
            [] => NodeLabels::sequence(self.first_label, self.points.len()),
            given => NodeLabels::try_new(given).map_err(refuse)?,
        };
        self.findings.labels_mapped |= labels.mapped();
        let all = self.corner_indices(&labels).map_err(|fault| MeshFileError {
            file: self.tets_file.clone().unwrap_or_else(|| name.to_owned()),
            fault,
        })?;
        let Sound { tets, kept, turned, bad, volume_in_file } = self.sound_tets(&all, format);
        if tets.is_empty() {
            return Err(refuse(self.nothing_to_model()));
        }
        let mid_edge = self.mid_edge_nodes(&labels, &kept, &turned);
        let regions = self.dense_regions(&kept);
        let mesh = TetMesh::try_new(self.points, tets, regions)
            .and_then(|mesh| mesh.with_mid_edge_nodes(mid_edge))
            .map_err(|error| refuse(Fault::Mesh(error)))?;
        self.findings.mending = Mending::new(bad, volume_in_file, &all, &kept, &mesh);
        self.findings.orphans = mesh.is_corner().iter().filter(|&&is_corner| !is_corner).count();
        Ok(MeshFile { format, mesh, findings: self.findings })
    }

    /// Corner indices of all tetrahedra of the file.
    fn corner_indices(&self, labels: &NodeLabels) -> Result<Vec<[u32; 4]>, Fault> {
        let mut all = Vec::with_capacity(self.tets.len());
        for (tet, corner_labels) in self.tets.iter().enumerate() {
            let mut corners = [0_u32; 4];
            for (corner, &label) in corners.iter_mut().zip(corner_labels) {
                *corner = labels.index(label).ok_or_else(|| Fault::UnknownNode {
                    tet,
                    label,
                    nodes: labels.describe(),
                })?;
            }
            all.push(corners);
        }
        Ok(all)
    }

    /// Mid-edge nodes of the kept tetrahedra, turned as these are; none unless each of the file has six.
    fn mid_edge_nodes(
        &mut self,
        labels: &NodeLabels,
        kept: &[usize],
        turned: &[bool],
    ) -> Vec<[u32; 6]> {
        if self.mid_edge.len() != self.tets.len() {
            return Vec::new();
        }
        let mut of_kept = Vec::with_capacity(kept.len());
        for (&tet, &is_turned) in kept.iter().zip(turned) {
            let mut nodes = [0_u32; 6];
            for (node, &label) in nodes.iter_mut().zip(&self.mid_edge[tet]) {
                match labels.index(label) {
                    Some(index) => *node = index,
                    None => {
                        let nodes = labels.describe();
                        self.findings.note(format!(
                            "mid-edge nodes are left out: tetrahedron {tet} (from 0) names node {label}, \
                             but {nodes}"
                        ));
                        return Vec::new();
                    }
                }
            }
            of_kept.push(if is_turned { mirrored_middles(nodes) } else { nodes });
        }
        of_kept
    }

    /// The tetrahedra that have volume, each once, ordered as [`TetMesh`] wants them.
    fn sound_tets(&mut self, all: &[[u32; 4]], format: Format) -> Sound {
        // The mesh counts volume from corner 4 (thesis 3.23), every format but the thesis lists
        // from corner 1: what is right there is mirrored here.
        let format_sign = if format == Format::ThesisLists { 1.0 } else { -1.0 };
        let mut bad = Vec::new();
        let mut volumes = Vec::with_capacity(all.len());
        for (tet, &corners) in all.iter().enumerate() {
            let (volume, least) = self.volume_and_least(corners);
            let in_file = volume * format_sign;
            match volume.abs() <= least || volume.is_nan() {
                true => bad.push(BadTet { tet, fault: TetFault::Flat, volume: in_file }),
                false => volumes.push((tet, volume)),
            }
        }
        // What has the four corners of an earlier one would count twice in the stiffness, and its
        // faces would hide the surface.
        let mut repeated = repeated(all, volumes.iter().map(|v| v.0)).into_iter().peekable();
        let mut sound = Sound {
            tets: Vec::new(),
            kept: Vec::new(),
            turned: Vec::new(),
            bad,
            volume_in_file: 0.0,
        };
        for &(tet, volume) in &volumes {
            let in_file = volume * format_sign;
            sound.volume_in_file += in_file;
            if let Some((_, of)) = repeated.next_if(|&(again, _)| again == tet) {
                let fault = TetFault::Repeated { of };
                sound.bad.push(BadTet { tet, fault, volume: in_file });
                continue;
            }
            if in_file < 0.0 {
                sound.bad.push(BadTet { tet, fault: TetFault::Inverted, volume: in_file });
            }
            sound.tets.push(if volume > 0.0 { all[tet] } else { mirrored(all[tet]) });
            sound.kept.push(tet);
            sound.turned.push(volume <= 0.0);
        }
        sound.bad.sort_unstable_by_key(|bad| bad.tet);
        let with = |name: &str| {
            let bad = sound.bad.iter().filter(|bad| bad.fault.name() == name);
            bad.map(|bad| bad.tet).collect::<Vec<_>>()
        };
        let findings = &mut self.findings;
        findings.flipped = with("inverted");
        findings.degenerate = with("flat");
        findings.repeated = with("repeated");
        if findings.flipped.len() == sound.kept.len() && sound.kept.len() > 1 {
            findings.note("every tetrahedron is ordered the other way round than usual");
        }
        sound
    }

    /// Signed volume (3.33 without the absolute value) and the least volume that is not rounding.
    ///
    /// Computed from the corners in ascending order, so that the same four give the same two numbers
    /// but for the sign, however a file orders them.
    fn volume_and_least(&self, corners: [u32; 4]) -> (f64, f64) {
        let mut ascending = corners;
        ascending.sort_unstable();
        let pairs = (0..4).flat_map(|i| (0..i).map(move |j| (j, i)));
        let swapped = pairs.filter(|&(j, i)| corners[j] > corners[i]).count();
        let sign = if swapped % 2 == 0 { 1.0 } else { -1.0 };
        let [c1, c2, c3, c4] = ascending.map(|node| self.points[node as usize]);
        let volume = sign * (c1 - c4).dot(&(c2 - c4).cross(&(c3 - c4))) / 6.0;
        let edges = [c1 - c2, c1 - c3, c1 - c4, c2 - c3, c2 - c4, c3 - c4];
        let longest = edges.iter().map(|edge| edge.norm_squared()).fold(0.0, f64::max).sqrt();
        (volume, DEGENERATE * longest * longest * longest)
    }

    /// Regions of the kept tetrahedra as 0, 1, 2 … in order of appearance; empty if there is one.
    fn dense_regions(&mut self, kept: &[usize]) -> Vec<u32> {
        let second = self.regions.iter().all(|region| region[0] == 0);
        let label_of = |tet: usize| {
            let [first, fallback] = self.regions.get(tet).copied().unwrap_or_default();
            if second { fallback } else { first }
        };
        let mut numbers = BTreeMap::new();
        let mut names = Vec::new();
        let mut regions = Vec::with_capacity(kept.len());
        for &tet in kept {
            let label = label_of(tet);
            let number = *numbers.entry(label).or_insert_with(|| {
                let name = self.region_names.get(&label).filter(|_| !second).cloned();
                names.push(name.unwrap_or_else(|| label.to_string()));
                names.len() as u32 - 1
            });
            regions.push(number);
        }
        if names.len() < 2 {
            return Vec::new();
        }
        self.findings.region_labels = names;
        regions
    }

    fn nothing_to_model(&self) -> Fault {
        let mut parts: Vec<String> = self
            .findings
            .other_cells
            .iter()
            .map(|(kind, count)| format!("{count} {kind}"))
            .collect();
        if !self.findings.degenerate.is_empty() {
            parts.push(format!("{} tetrahedra without volume", self.findings.degenerate.len()));
        }
        if parts.is_empty() {
            parts.push(format!("{} nodes and no cells", self.points.len()));
        }
        Fault::NoTetrahedra { found: parts.join(", ") }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit_points() -> Vec<Point3<f64>> {
        vec![
            Point3::origin(),
            Point3::new(1.0, 0.0, 0.0),
            Point3::new(0.0, 1.0, 0.0),
            Point3::new(0.0, 0.0, 1.0),
            Point3::new(1.0, 1.0, 0.0),
        ]
    }

    fn raw(tets: &[[i64; 4]], regions: &[[i64; 2]]) -> RawMesh {
        RawMesh {
            points: unit_points(),
            tets: tets.to_vec(),
            regions: regions.to_vec(),
            ..RawMesh::default()
        }
    }

    #[test]
    fn inverted_is_turned_and_flat_is_dropped() {
        let raw = raw(&[[0, 1, 2, 3], [1, 2, 4, 3], [0, 1, 2, 4], [1, 1, 2, 3]], &[[0; 2]; 4]);
        let file = raw.finish("f", Format::Medit).unwrap();
        assert_eq!(file.findings.flipped, [1]);
        assert_eq!(file.findings.degenerate, [2, 3]);
        assert_eq!(file.findings.orphans, 0);
        assert_eq!(file.mesh.tets(), [[0, 1, 3, 2], [1, 2, 4, 3]]);
    }

    #[test]
    fn regions_are_numbered_by_appearance_with_their_labels_kept() {
        let tets = [[0, 1, 2, 3], [4, 2, 1, 3], [0, 1, 4, 3]];
        let file = raw(&tets, &[[7, 1], [-2, 1], [7, 1]]).finish("f", Format::Vega).unwrap();
        assert_eq!(file.mesh.regions(), [0, 1, 0]);
        assert_eq!(file.findings.region_labels, ["7", "-2"]);
        let file = raw(&tets, &[[0, 1], [0, 9], [0, 1]]).finish("f", Format::Vega).unwrap();
        assert_eq!(file.findings.region_labels, ["1", "9"]);
        let file = raw(&tets, &[[3, 1], [3, 9], [3, 1]]).finish("f", Format::Vega).unwrap();
        assert!(file.mesh.regions().is_empty() && file.findings.region_labels.is_empty());
    }

    #[test]
    fn a_file_without_tetrahedra_says_what_it_has() {
        let mut raw = raw(&[], &[]);
        raw.count_cells(CellKind::new(Shape::Triangle, 3), 3012);
        let error = raw.finish("a.vtk", Format::VtkLegacy).unwrap_err();
        assert_eq!(error.to_string(), "a.vtk: no tetrahedra: 3012 triangles");
    }

    #[test]
    fn a_node_that_is_not_there_is_named() {
        let error = raw(&[[0, 1, 2, 5]], &[[0; 2]]).finish("f", Format::Tet).unwrap_err();
        let text = "f: tetrahedron 0 (from 0) names node 5, but there are 5 nodes, 0 to 4";
        assert_eq!(error.to_string(), text);
    }

    #[test]
    fn overflowing_volumes_are_not_volumes() {
        let mut raw = raw(&[[0, 1, 2, 3]], &[[0; 2]]);
        raw.points.iter_mut().for_each(|p| *p *= 1e200);
        assert!(matches!(
            raw.finish("f", Format::Tet).unwrap_err().fault,
            Fault::NoTetrahedra { .. }
        ));
    }
}
