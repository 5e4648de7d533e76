//! Frames: answers for one prescribed displacement after the other, with a proven bound of the error.

use nalgebra::Vector3;

use super::load_case::{Answer, Inexactness, LoadCase, SoftBodyError, reactions};
use crate::model::Model;
use crate::solve::condensed::{Base, Columns, ContactSet, Delivery, Touched};

/// Memory that columns of the compliance may take, bytes.
const COLUMNS_BYTES: usize = 512 << 20;

/// A body that is ready for frames by `condensed`: one factor, a column of the compliance for each node
/// that was ever touched, and the small system of the nodes that are touched now.
///
/// Shapes: N nodes. Units: m, N. Frame: that of the mesh.
///
/// ```
/// use nalgebra::Vector3;
/// use softgrasp_core::mesh::{BuiltIn, generate};
/// use softgrasp_core::{Inexactness, LoadCase, Material, SoftBody};
///
/// let ball = generate(BuiltIn::Sphere, 300)?;
/// let extreme = |along: fn(&nalgebra::Point3<f64>) -> f64| {
///     let nodes = ball.vertices().iter().zip(0u32..);
///     nodes.max_by(|(a, _), (b, _)| along(a).total_cmp(&along(b))).map_or(0, |(_, node)| node)
/// };
/// let tips = [extreme(|p| p.x), extreme(|p| -p.x), extreme(|p| p.y)];
/// let body = SoftBody::try_new(ball.clone(), Material::try_new(2.0e4, 0.3)?)?;
/// let mut frames = body.frames()?;
/// for tick in 1..=20 {
///     let deeper = 1e-4 * f64::from(tick);
///     let mut squeeze = LoadCase::new();
///     squeeze.prescribe(tips[0], Vector3::new(-deeper, 0.0, 0.0));
///     squeeze.prescribe(tips[1], Vector3::new(deeper, 0.0, 0.0));
///     squeeze.hold([tips[2]]);
///     let frame = frames.answer(&squeeze)?;
///     assert!(matches!(frame.inexactness, Inexactness::Proven(error) if error < 1e-6));
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Frames<'a> {
    model: &'a Model,
    base: Base,
    columns: Columns,
    /// The small system of the newest frame.
    set: Option<ContactSet>,
    nodes: Vec<u32>,
}

impl<'a> Frames<'a> {
    /// Factors the base and proves the bound's eigenvalue, which takes two factors.
    pub(super) fn try_new(model: &'a Model) -> Result<Self, SoftBodyError> {
        let base = model.condense(None, &mut |_| {})?;
        base.prove_eigenvalue_min();
        let nodes = (0..).take(model.mesh().node_count()).collect();
        Ok(Self { model, base, columns: Columns::new(COLUMNS_BYTES), set: None, nodes })
    }

    /// Displacements under prescribed displacements. A node that is touched for the first time costs
    /// three solves, other values of the same nodes a product only.
    ///
    /// # Errors
    /// [`SoftBodyError`]: forces, nodes that are not there, a body that can still move.
    pub fn answer(&mut self, case: &LoadCase) -> Result<Answer, SoftBodyError> {
        if case.has_forces() {
            return Err(SoftBodyError::ForceInFrame);
        }
        let (known, _) = case.of(self.model)?;
        let kept = self.set.take().filter(|set| set.dofs() == known.dofs);
        let set = match kept {
            Some(set) => set,
            None => {
                self.model.check_held(&known.dofs, &[])?;
                let touched = Touched::of_dofs(&known.dofs);
                let mut set = ContactSet::try_new(&self.base, &self.columns, &touched)?;
                set.want(&self.base, &self.nodes);
                set.refine(&self.base);
                set
            }
        };
        let found = set.solve(&known.q_known)?;
        let displacements = set.wanted_displacements(&found);
        let delivery = Delivery::Double;
        let certificate = set.certify(&self.base, &known.q_known, &found, &displacements, delivery);
        self.set = Some(set);
        Ok(Answer {
            displacements: displacements.into_iter().map(Vector3::from).collect(),
            reactions: reactions(&known.dofs, &found.lambda),
            residual_rel: certificate.residual_rel,
            inexactness: match certificate.error_bound_rel {
                Ok(error) => Inexactness::Proven(error),
                Err(reason) => Inexactness::Unknown(reason),
            },
        })
    }
}
