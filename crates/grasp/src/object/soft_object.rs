//! The object in the hand: its rest shape, its deformed shape, and the sphere tree that follows.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use softgrasp_core::mesh::{Surface, TetMesh};

use super::rest_shape::{ObjectError, RestShape};
use crate::sphere_tree::{SphereTree, vertex_normals};

/// A soft object as the client knows it.
///
/// Units: m. Frame: the object's own.
/// Invariant: `tree` and `normals` belong to `shape`; `shape` is the rest shape unless an answer
/// of the server has been applied since the last [`SoftObject::relax`].
pub struct SoftObject {
    rest: Arc<RestShape>,
    shape: Vec<Point3<f64>>,
    displacement: Vec<[f64; 3]>,
    deformed: bool,
    /// Whether the nodes inside are where the last answer has them, and not only the surface.
    whole: bool,
    tree: SphereTree,
    normals: Vec<Vector3<f64>>,
    rest_shapes: u64,
}

impl SoftObject {
    /// An object at rest.
    ///
    /// # Errors
    /// [`ObjectError::Tree`].
    pub fn try_new(mesh: TetMesh) -> Result<Self, ObjectError> {
        Ok(Self::at_rest(RestShape::try_new(mesh)?, 1))
    }

    /// An object at rest in its `rest_shapes`-th rest shape.
    pub fn at_rest(rest: impl Into<Arc<RestShape>>, rest_shapes: u64) -> Self {
        let rest = rest.into();
        let shape = rest.mesh().vertices().to_vec();
        Self {
            displacement: vec![[0.0; 3]; shape.len()],
            shape,
            deformed: false,
            whole: true,
            tree: rest.tree().clone(),
            normals: rest.normals().to_vec(),
            rest_shapes,
            rest,
        }
    }

    /// Mesh of the rest shape, to which the object returns when nothing holds it.
    pub fn rest(&self) -> &TetMesh {
        self.rest.mesh()
    }

    /// Rest shape with surface, sphere tree and normals, to be read by other threads too.
    pub fn rest_shape(&self) -> &Arc<RestShape> {
        &self.rest
    }

    /// Boundary surface: triangles and nodes.
    pub fn surface(&self) -> &Surface {
        self.rest.surface()
    }

    /// Positions of all vertices as they are now, m.
    pub fn shape(&self) -> &[Point3<f64>] {
        &self.shape
    }

    /// Displacement of every node from the rest shape, m.
    pub fn displacement(&self) -> &[[f64; 3]] {
        &self.displacement
    }

    /// Sphere tree over the surface as it is now.
    pub fn tree(&self) -> &SphereTree {
        &self.tree
    }

    /// Vertex normals of the surface as it is now, by node.
    pub fn normals(&self) -> &[Vector3<f64>] {
        &self.normals
    }

    /// How many rest shapes there have been; counts up with every kept shape.
    pub fn rest_shapes(&self) -> u64 {
        self.rest_shapes
    }

    /// Moves every vertex to its displaced place and lets the tree follow (thesis 3.5.3).
    ///
    /// # Errors
    /// [`ObjectError::Count`], [`ObjectError::Tree`] for coordinates that are not finite; the
    /// shape is then as before.
    pub fn apply(&mut self, displacement: Vec<[f64; 3]>) -> Result<(), ObjectError> {
        let expected = self.shape.len();
        if displacement.len() != expected {
            return Err(ObjectError::Count { got: displacement.len(), expected });
        }
        let moved = self.rest().vertices().iter().zip(&displacement);
        self.follow(moved.map(|(p, u)| p + Vector3::from(*u)).collect())?;
        self.displacement = displacement;
        (self.deformed, self.whole) = (true, true);
        Ok(())
    }

    /// Moves the surface alone, which is all that is seen and touched; the nodes inside stay where they
    /// are until [`SoftObject::apply`] comes.
    ///
    /// Shapes: `displacement` one per node of [`Surface::nodes`], in their order.
    ///
    /// # Errors
    /// Those of [`SoftObject::apply`].
    pub fn apply_to_surface(&mut self, displacement: &[[f64; 3]]) -> Result<(), ObjectError> {
        let expected = self.surface().nodes.len();
        if displacement.len() != expected {
            return Err(ObjectError::Count { got: displacement.len(), expected });
        }
        let mut shape = self.shape.clone();
        for (&node, u) in self.rest.surface().nodes.iter().zip(displacement) {
            let node = node as usize;
            shape[node] = self.rest.mesh().vertices()[node] + Vector3::from(*u);
            self.displacement[node] = *u;
        }
        self.follow(shape)?;
        (self.deformed, self.whole) = (true, false);
        Ok(())
    }

    /// Whether every node is where the last answer has it, so that the shape can be kept.
    pub fn is_whole(&self) -> bool {
        self.whole
    }

    /// Takes the object back to its rest shape, when the fingers have let go.
    ///
    /// # Errors
    /// [`ObjectError::Tree`], not seen for a shape that once was good.
    pub fn relax(&mut self) -> Result<(), ObjectError> {
        if self.deformed {
            self.follow(self.rest().vertices().to_vec())?;
            self.displacement.fill([0.0; 3]);
            (self.deformed, self.whole) = (false, true);
        }
        Ok(())
    }

    fn follow(&mut self, shape: Vec<Point3<f64>>) -> Result<(), ObjectError> {
        self.tree.refit(&shape)?;
        if self.tree.needs_rebuild() {
            self.tree = SphereTree::try_build(&shape, &self.surface().nodes)?;
        }
        vertex_normals(&shape, &self.rest.surface().triangles, &mut self.normals)?;
        self.shape = shape;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softgrasp_core::mesh::{BuiltIn, generate};

    fn cube() -> SoftObject {
        SoftObject::try_new(generate(BuiltIn::Cube, 64).unwrap()).unwrap()
    }

    #[test]
    fn relaxed_object_has_its_rest_shape_to_the_bit() {
        let mut object = cube();
        object.apply(vec![[0.001, -0.002, 0.0005]; 64]).unwrap();
        assert!(object.shape() != object.rest().vertices());
        object.relax().unwrap();
        assert!(object.shape() == object.rest().vertices());
        assert!(object.displacement().iter().flatten().all(|&u| u == 0.0));
    }

    #[test]
    fn surface_answer_moves_the_surface_and_nothing_inside() {
        let mut object = cube();
        let nodes = object.surface().nodes.clone();
        let u = |node: u32| [1e-4 * f64::from(node), 0.0, -1e-4];
        let answer: Vec<_> = nodes.iter().map(|&node| u(node)).collect();
        object.apply_to_surface(&answer).unwrap();
        assert!(!object.is_whole());
        for node in 0..64u32 {
            let moved = object.shape()[node as usize] - object.rest().vertices()[node as usize];
            let expected = if nodes.contains(&node) { u(node) } else { [0.0; 3] };
            assert!((moved - Vector3::from(expected)).norm() < 1e-15, "node {node}");
        }
        assert!(object.apply_to_surface(&answer[1..]).is_err());
        object.apply((0..64).map(u).collect()).unwrap();
        assert!(object.is_whole());
    }

    #[test]
    fn kept_shape_becomes_the_rest_shape_and_counts() {
        let mut object = cube();
        object.apply((0..64).map(|n| [0.0, 1e-4 * f64::from(n), 0.0]).collect()).unwrap();
        let shape = object.shape().to_vec();
        let kept = object.rest_shape().kept(shape.clone()).unwrap();
        let kept = SoftObject::at_rest(kept, object.rest_shapes() + 1);
        assert!(kept.rest().vertices() == shape.as_slice() && kept.shape() == shape.as_slice());
        assert_eq!(kept.rest_shapes(), 2);
    }
}
