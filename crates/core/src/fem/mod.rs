//! Finite elements: material, element stiffness, assembly, strain.
