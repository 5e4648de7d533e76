//! Encodes a mesh with its displacements and fields as a VTU file.

use softgrasp_core::mesh::TetMesh;
use softgrasp_core::mesh_io::{VtuField, WriteError, write_vtu_fields};
use softgrasp_protocol::{FieldPlace, FieldValues};

/// Vector field of the nodes that is written beside the fields of an answer.
pub struct NodeVectors<'a> {
    /// Name of the field, as viewers show it.
    pub name: &'a str,
    /// Unit of the values.
    pub unit: &'a str,
    /// Vector of each node.
    pub values: &'a [[f64; 3]],
}

/// VTU file of the mesh at rest with vectors of its nodes and, where given, the fields of an answer about
/// all its nodes.
///
/// Shapes: `labels` empty or one for each region.
///
/// # Errors
/// [`WriteError`] if a field does not fit the mesh.
pub fn encode_fields(
    mesh: &TetMesh,
    labels: &[String],
    vectors: &[NodeVectors<'_>],
    fields: Option<&FieldValues>,
) -> Result<Vec<u8>, WriteError> {
    let vectors = vectors.iter().map(|NodeVectors { name, unit, values }| VtuField {
        name,
        unit,
        components: 3,
        values: values.as_flattened(),
    });
    let of_answer = |place: FieldPlace| {
        let fields = fields.iter().flat_map(|fields| &fields.arrays);
        fields.filter(move |(field, _)| field.place() == place).map(|(field, values)| VtuField {
            name: field.name(),
            unit: field.unit(),
            components: field.components(),
            values,
        })
    };
    let of_nodes: Vec<VtuField<'_>> = vectors.chain(of_answer(FieldPlace::Nodes)).collect();
    let of_elements: Vec<VtuField<'_>> = of_answer(FieldPlace::Elements).collect();
    write_vtu_fields(mesh, labels, &of_nodes, &of_elements)
}
