//! Earlier rest shapes of an object, so that keeping a shape can be undone.

use std::collections::VecDeque;
use std::sync::Arc;

use softgrasp_grasp::object::RestShape;

/// Earlier rest shapes, the latest last.
#[derive(Default)]
pub struct ShapeHistory {
    earlier: VecDeque<Arc<RestShape>>,
}

/// Largest number of earlier shapes; the oldest are dropped.
pub const UNDO_MAX: usize = 20;

impl ShapeHistory {
    /// Adds a rest shape that a kept one has replaced.
    pub fn push(&mut self, rest: Arc<RestShape>) {
        if self.earlier.len() == UNDO_MAX {
            self.earlier.pop_front();
        }
        self.earlier.push_back(rest);
    }

    /// The rest shape before the present one.
    pub fn last(&self) -> Option<&Arc<RestShape>> {
        self.earlier.back()
    }

    /// The oldest rest shape that is still known.
    pub fn first(&self) -> Option<&Arc<RestShape>> {
        self.earlier.front()
    }

    /// Removes the latest shape, because it is the present one again.
    pub fn pop(&mut self) {
        self.earlier.pop_back();
    }

    /// Forgets all shapes, because the object is another one.
    pub fn clear(&mut self) {
        self.earlier.clear();
    }

    /// Number of times that keeping a shape can be undone.
    pub fn len(&self) -> usize {
        self.earlier.len()
    }

    /// Whether nothing can be undone.
    pub fn is_empty(&self) -> bool {
        self.earlier.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softgrasp_core::mesh::{BuiltIn, generate};

    #[test]
    fn latest_shapes_come_back_first_and_the_oldest_are_forgotten() {
        let mesh = generate(BuiltIn::Cube, 27).unwrap();
        let shapes: Vec<_> = (0..UNDO_MAX + 3)
            .map(|_| Arc::new(RestShape::try_new(mesh.clone()).unwrap()))
            .collect();
        let mut history = ShapeHistory::default();
        shapes.iter().for_each(|shape| history.push(Arc::clone(shape)));
        assert_eq!(history.len(), UNDO_MAX);
        for shape in shapes[3..].iter().rev() {
            assert!(Arc::ptr_eq(history.last().unwrap(), shape));
            history.pop();
        }
        assert!(history.is_empty() && history.last().is_none());
    }
}
