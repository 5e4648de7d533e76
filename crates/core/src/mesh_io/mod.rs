//! Mesh files: bytes in, [`crate::mesh::TetMesh`] and findings out; decided by content.
