//! What one rank gets of a mesh: its own nodes, those around them, and the elements that it needs for the
//! rows of its own.

use bytemuck::{Pod, cast_slice};
use nalgebra::Point3;
use softgrasp_core::TetMesh;
use softgrasp_core::fem::Element;
use softgrasp_core::model::Known;

use crate::partition::Numbering;

/// A rank's part of the equations. Its nodes and elements stand in the order of the whole mesh.
///
/// Shapes: n nodes, t elements, k known degrees of freedom on them, c cases.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Part {
    /// Nodes of the whole mesh, ascending, n.
    pub nodes: Vec<u32>,
    /// Their numbers among all ranks, n.
    pub numbers: Vec<u32>,
    /// First number of this rank, and the one behind its last.
    pub own: [u32; 2],
    /// Where the nodes are, n, m.
    pub places: Vec<[f64; 3]>,
    /// Corners of the elements as positions in `nodes`, t.
    pub tets: Vec<[u32; 4]>,
    /// Region of each element, t, or empty.
    pub regions: Vec<u32>,
    /// Young's modulus and Poisson's ratio of each region.
    pub materials: Vec<[f64; 2]>,
    /// Kind of element: 0 t4, 1 t4-anp.
    pub element: u32,
    /// Known degrees of freedom as `3 · position + axis`, ascending, k.
    pub known: Vec<u32>,
    /// Their values, case after case, c × k, m.
    pub values: Vec<f64>,
    /// Number of cases.
    pub cases: u32,
    /// Forces on the nodes, 3n, N; empty if there are none.
    pub forces: Vec<f64>,
}

/// Mesh and loads that are cut into parts.
pub struct Whole<'a> {
    /// The mesh.
    pub mesh: &'a TetMesh,
    /// Kind of element.
    pub element: Element,
    /// Materials by region.
    pub materials: &'a [softgrasp_core::Material],
    /// Known displacements of all cases, of the same degrees of freedom.
    pub known: Vec<&'a Known>,
    /// Forces by degree of freedom; empty if there are none.
    pub forces: &'a [f64],
}

impl Part {
    /// The part of one rank.
    pub fn cut(whole: &Whole<'_>, numbering: &Numbering, rank: usize) -> Self {
        let (mesh, element) = (whole.mesh, whole.element);
        let mut is_reached: Vec<bool> =
            numbering.owner.iter().map(|&owner| owner == rank as u32).collect();
        let touches = |is_reached: &[bool], tet: &[u32; 4]| {
            tet.iter().any(|&corner| is_reached[corner as usize])
        };
        // Averaged pressure couples a node with the neighbours of its neighbours.
        let layers = if element == Element::Tet4Anp { 2 } else { 1 };
        let mut chosen: Vec<u32> = Vec::new();
        for _ in 0..layers {
            let around = (0..mesh.tets().len() as u32)
                .filter(|&tet| touches(&is_reached, &mesh.tets()[tet as usize]));
            chosen = around.collect();
            for &tet in &chosen {
                mesh.tets()[tet as usize].iter().for_each(|&n| is_reached[n as usize] = true);
            }
        }
        let nodes: Vec<u32> =
            (0..mesh.node_count() as u32).filter(|&n| is_reached[n as usize]).collect();
        let mut position = vec![u32::MAX; mesh.node_count()];
        nodes.iter().enumerate().for_each(|(at, &n)| position[n as usize] = at as u32);
        let corners = |&tet: &u32| mesh.tets()[tet as usize].map(|n| position[n as usize]);
        let (known, values) = known_of(&whole.known, &position);
        Self {
            numbers: nodes.iter().map(|&n| numbering.number[n as usize]).collect(),
            own: [numbering.start[rank], numbering.start[rank + 1]],
            places: nodes.iter().map(|&n| mesh.vertices()[n as usize].coords.into()).collect(),
            tets: chosen.iter().map(corners).collect(),
            regions: match mesh.regions() {
                [] => Vec::new(),
                regions => chosen.iter().map(|&tet| regions[tet as usize]).collect(),
            },
            materials: whole.materials.iter().map(|m| [m.young(), m.poisson()]).collect(),
            element: u32::from(element == Element::Tet4Anp),
            known,
            values,
            cases: whole.known.len() as u32,
            forces: match whole.forces {
                [] => Vec::new(),
                forces => nodes
                    .iter()
                    .flat_map(|&n| forces[3 * n as usize..][..3].iter())
                    .copied()
                    .collect(),
            },
            nodes,
        }
    }

    /// Number of nodes that this rank owns.
    pub fn own_count(&self) -> usize {
        (self.own[1] - self.own[0]) as usize
    }

    /// Positions of the nodes that this rank owns, in the order of their numbers.
    pub fn own_positions(&self) -> impl Iterator<Item = usize> {
        let own = self.own[0]..self.own[1];
        (0..self.nodes.len()).filter(move |&at| own.contains(&self.numbers[at]))
    }

    /// Kind of element.
    pub fn element(&self) -> Element {
        match self.element {
            0 => Element::Tet4,
            _ => Element::Tet4Anp,
        }
    }

    /// Places as points.
    pub fn points(&self) -> Vec<Point3<f64>> {
        self.places.iter().copied().map(Point3::from).collect()
    }

    /// The part as bytes for another rank.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        put(&mut bytes, &self.nodes);
        put(&mut bytes, &self.numbers);
        put(&mut bytes, &[self.own[0], self.own[1], self.element, self.cases]);
        put(&mut bytes, &self.places);
        put(&mut bytes, &self.tets);
        put(&mut bytes, &self.regions);
        put(&mut bytes, &self.materials);
        put(&mut bytes, &self.known);
        put(&mut bytes, &self.values);
        put(&mut bytes, &self.forces);
        bytes
    }

    /// The part of bytes that another rank made; `None` if they are cut.
    pub fn from_bytes(mut bytes: &[u8]) -> Option<Self> {
        let rest = &mut bytes;
        let (nodes, numbers) = (take(rest)?, take(rest)?);
        let [from, to, element, cases]: [u32; 4] = take(rest)?.try_into().ok()?;
        Some(Self {
            nodes,
            numbers,
            own: [from, to],
            element,
            cases,
            places: take(rest)?,
            tets: take(rest)?,
            regions: take(rest)?,
            materials: take(rest)?,
            known: take(rest)?,
            values: take(rest)?,
            forces: take(rest)?,
        })
    }
}

/// Known degrees of freedom on the nodes that have a position, and their values case after case.
fn known_of(cases: &[&Known], position: &[u32]) -> (Vec<u32>, Vec<f64>) {
    let Some(first) = cases.first() else { return (Vec::new(), Vec::new()) };
    let is_here: Vec<usize> = (0..first.dofs.len())
        .filter(|&i| position[first.dofs[i] as usize / 3] != u32::MAX)
        .collect();
    let local = |&i: &usize| {
        let dof = first.dofs[i];
        3 * position[dof as usize / 3] + dof % 3
    };
    let values = cases.iter().flat_map(|known| is_here.iter().map(|&i| known.q_known[i]));
    (is_here.iter().map(local).collect(), values.collect())
}

fn put<T: Pod>(bytes: &mut Vec<u8>, values: &[T]) {
    let raw: &[u8] = cast_slice(values);
    bytes.extend((values.len() as u64).to_le_bytes());
    bytes.extend(raw);
}

fn take<T: Pod>(bytes: &mut &[u8]) -> Option<Vec<T>> {
    let (count, rest) = bytes.split_first_chunk::<8>()?;
    let len = usize::try_from(u64::from_le_bytes(*count)).ok()?.checked_mul(size_of::<T>())?;
    let (raw, rest) = rest.split_at_checked(len)?;
    *bytes = rest;
    Some(bytemuck::pod_collect_to_vec(raw))
}

#[cfg(test)]
mod tests {
    use super::*;
    use softgrasp_core::Material;
    use softgrasp_core::mesh::{BuiltIn, generate};

    #[test]
    fn parts_own_every_node_once_and_come_back_from_their_bytes() {
        let mesh = generate(BuiltIn::Sphere, 500).unwrap();
        let known = Known { dofs: vec![0, 4, 700], q_known: vec![0.5, 0.25, -1.0] };
        let other = Known { q_known: vec![3.0, 2.0, 1.0], ..known.clone() };
        let forces: Vec<f64> = (0..3 * mesh.node_count()).map(|i| i as f64).collect();
        let materials = [Material::try_new(2.0, 0.3).unwrap()];
        let whole = Whole {
            mesh: &mesh,
            element: Element::Tet4,
            materials: &materials,
            known: vec![&known, &other],
            forces: &forces,
        };
        let numbering = Numbering::new(mesh.vertices(), &mesh.used_nodes(), 3);
        let mut owned = vec![0; mesh.node_count()];
        for rank in 0..3 {
            let part = Part::cut(&whole, &numbering, rank);
            for at in part.own_positions() {
                owned[part.nodes[at] as usize] += 1;
                assert_eq!(part.forces[3 * at], 3.0 * f64::from(part.nodes[at]));
            }
            assert_eq!(part.own_positions().count(), part.own_count());
            assert_eq!(part.values.len(), 2 * part.known.len());
            let bytes = part.to_bytes();
            assert_eq!(Part::from_bytes(&bytes), Some(part));
            assert_eq!(Part::from_bytes(&bytes[..bytes.len() - 1]), None);
        }
        assert!(owned.iter().all(|times| *times == 1));
    }
}
