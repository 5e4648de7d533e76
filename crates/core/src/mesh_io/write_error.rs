//! Errors of writing a mesh: data that do not belong to it.

/// Data for a file that does not fit the mesh.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WriteError {
    /// A field has not one value per node or element.
    #[error("field {field}: expected {expected} values, found {found}")]
    FieldLength {
        /// Name of the field.
        field: String,
        /// Nodes or elements of the mesh.
        expected: usize,
        /// Values given.
        found: usize,
    },
    /// A triangle of the display list names a node that is not there.
    #[error("display triangle {triangle} names node {node}, but there are {node_count} nodes")]
    DisplayNode {
        /// Triangle index, from 0.
        triangle: usize,
        /// The node.
        node: u32,
        /// Nodes of the mesh.
        node_count: usize,
    },
}
