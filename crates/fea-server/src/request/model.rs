//! Makes a model from the mesh, materials, element and fixed degrees of freedom of a message.

use nalgebra::Point3;
use softgrasp_core::fem::{Element, Material};
use softgrasp_core::mesh::{TetMesh, mirrored, mirrored_middles, signed_volume};
use softgrasp_core::model::Model;
use softgrasp_protocol::{ElementChoice, ElementName, Material as MaterialMessage, MeshData};

use crate::clock::StageClock;
use crate::refusal::Refusal;

/// Makes a model and checks all that it is made of.
///
/// # Errors
/// [`Refusal`] that names the fault of mesh, materials or fixed degrees of freedom.
pub(crate) fn model_of(
    mesh: MeshData,
    materials: &[MaterialMessage],
    element: Element,
    fixed: Vec<u32>,
    clock: &mut StageClock,
) -> Result<Model, Refusal> {
    let (mesh, materials) = mesh_of(mesh, materials)?;
    Ok(Model::try_new(mesh, element, &materials, fixed, &mut |stage| clock.begin(stage))?)
}

/// Makes mesh and materials and checks them.
///
/// # Errors
/// [`Refusal`] that names the fault of mesh or materials.
pub(crate) fn mesh_of(
    mesh: MeshData,
    materials: &[MaterialMessage],
) -> Result<(TetMesh, Vec<Material>), Refusal> {
    if materials.is_empty() {
        return Err(Refusal::NoMaterial);
    }
    let materials: Vec<Material> = materials
        .iter()
        .map(|m| Material::try_new(m.young, m.poisson))
        .collect::<Result<_, _>>()?;
    let regions = ranks(&mesh.regions, materials.len())?;
    let vertices: Vec<_> = mesh.vertices.into_iter().map(Point3::from).collect();
    let mut tets = mesh.tets;
    let mut mid_edge = mesh.mid_edge;
    for (at, tet) in tets.iter_mut().enumerate() {
        if is_mirrored(&vertices, *tet) {
            *tet = mirrored(*tet);
            if let Some(nodes) = mid_edge.get_mut(at) {
                *nodes = mirrored_middles(*nodes);
            }
        }
    }
    let mesh = TetMesh::try_new(vertices, tets, regions)?.with_mid_edge_nodes(mid_edge)?;
    Ok((mesh, materials))
}

/// Refuses a mesh of more nodes than the server takes, before anything is allocated for it.
///
/// # Errors
/// [`Refusal::TooManyNodes`] with both numbers.
pub(crate) fn check_node_count(mesh: &MeshData, max: u32) -> Result<(), Refusal> {
    let node_count = mesh.vertices.len();
    match node_count > max as usize {
        true => Err(Refusal::TooManyNodes { node_count, max }),
        false => Ok(()),
    }
}

/// Name of an element on the wire.
pub(crate) fn name_of(element: Element) -> ElementName {
    match element {
        Element::Tet4 => ElementName::T4,
        Element::Tet10 => ElementName::T10,
        Element::Tet4Anp => ElementName::T4Anp,
    }
}

/// Element that a name on the wire stands for.
pub(crate) fn element_of(name: ElementName) -> Element {
    match name {
        ElementName::T4 => Element::Tet4,
        ElementName::T10 => Element::Tet10,
        ElementName::T4Anp => Element::Tet4Anp,
    }
}

/// The element that a request names; `None` where it leaves the choice to the server.
pub(crate) fn element_given(choice: ElementChoice) -> Option<Element> {
    match choice {
        ElementChoice::T4 => Some(Element::Tet4),
        ElementChoice::T10 => Some(Element::Tet10),
        ElementChoice::T4Anp => Some(Element::Tet4Anp),
        ElementChoice::Auto => None,
    }
}

/// Largest Poisson's ratio of some materials.
pub(crate) fn poisson_max(materials: &[MaterialMessage]) -> f64 {
    materials.iter().map(|material| material.poisson).fold(-1.0, f64::max)
}

/// Whether the corners of an element are in the other order than that of (3.23). Gmsh and VTK use the other
/// orientation; clients may send either, since the stiffness does not depend on it.
fn is_mirrored(vertices: &[Point3<f64>], tet: [u32; 4]) -> bool {
    let corner = |i: usize| vertices.get(tet[i] as usize).copied();
    match (corner(0), corner(1), corner(2), corner(3)) {
        (Some(a), Some(b), Some(c), Some(d)) => signed_volume(&[a, b, c, d]) < 0.0,
        // Indices out of range are refused with the mesh.
        _ => false,
    }
}

/// Region of each element as a position in the list of materials, which is in ascending order of the
/// labels; empty if one material is for the whole body. Labels are any numbers, so nothing is allocated
/// by them.
fn ranks(labels: &[u32], materials: usize) -> Result<Vec<u32>, Refusal> {
    if materials == 1 {
        return Ok(Vec::new());
    }
    let mut known = labels.to_vec();
    known.sort_unstable();
    known.dedup();
    // Without labels all elements belong to one region.
    if known.len().max(1) != materials {
        return Err(Refusal::Regions { labels: known.len(), materials });
    }
    Ok(labels.iter().map(|label| known.partition_point(|k| k < label) as u32).collect())
}
