//! Frames: answers for one prescribed displacement after the other, with a proven bound of the error.

use std::sync::Arc;

use nalgebra::Vector3;

use super::load_case::{Answer, Inexactness, LoadCase, SoftBodyError, reactions};
use crate::model::{Known, Model};
use crate::solve::condensed::{
    Base, Certificate, Columns, ContactSet, Delivery, LoadColumn, LoadedSet, Touched, UnitLoad,
};

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
    set: Option<Arc<ContactSet>>,
    /// Forces of the newest frame on which some acted, and what they do to the held shape.
    load: Option<(Vec<f64>, Arc<LoadColumn>)>,
    /// The small system with these forces.
    loaded: Option<LoadedSet>,
    nodes: Vec<u32>,
}

impl<'a> Frames<'a> {
    /// Factors the base and proves the bound's eigenvalue, which takes two factors.
    pub(super) fn try_new(model: &'a Model) -> Result<Self, SoftBodyError> {
        let base = model.condense(None, &mut |_| {})?;
        base.prove_eigenvalue_min();
        Ok(Self::of_base(model, base))
    }

    /// Makes a multigrid hierarchy of the base instead of a factor.
    pub(super) fn without_factor(model: &'a Model) -> Result<Self, SoftBodyError> {
        Ok(Self::of_base(model, model.condense_without_factor()?))
    }

    fn of_base(model: &'a Model, base: Base) -> Self {
        let nodes = (0..).take(model.mesh().node_count()).collect();
        let (set, load, loaded) = (None, None, None);
        Self { model, base, columns: Columns::new(COLUMNS_BYTES), set, load, loaded, nodes }
    }

    /// Displacements under prescribed displacements and forces. A node that is touched for the first time
    /// costs three solves, other forces than in the last frame one; other values of the same nodes cost a
    /// product only.
    ///
    /// # Errors
    /// [`SoftBodyError`]: nodes that are not there, a body that can still move.
    pub fn answer(&mut self, case: &LoadCase) -> Result<Answer, SoftBodyError> {
        let (known, forces) = case.of(self.model)?;
        let set = self.set_of(&known.dofs)?;
        match forces.is_empty() {
            true => self.unloaded(&set, &known),
            false => self.loaded(&set, &known, forces),
        }
    }

    /// The small system of some known degrees of freedom, kept from the last frame or made now.
    fn set_of(&mut self, dofs: &[u32]) -> Result<Arc<ContactSet>, SoftBodyError> {
        if let Some(set) = self.set.as_ref().filter(|set| set.dofs() == dofs) {
            return Ok(Arc::clone(set));
        }
        self.model.check_held(dofs, &[])?;
        let touched = Touched::of_dofs(dofs);
        let mut set = ContactSet::try_new(&self.base, &self.columns, &touched)?;
        set.want(&self.base, &self.nodes);
        set.refine(&self.base);
        let set = Arc::new(set);
        self.set = Some(Arc::clone(&set));
        self.loaded = None;
        Ok(set)
    }

    fn unloaded(&self, set: &ContactSet, known: &Known) -> Result<Answer, SoftBodyError> {
        let found = set.solve(&known.q_known)?;
        let displacements = set.wanted_displacements(&found);
        let delivery = Delivery::Double;
        let certificate = set.certify(&self.base, &known.q_known, &found, &displacements, delivery);
        Ok(answer(known, displacements, &found.lambda, certificate))
    }

    fn loaded(
        &mut self,
        set: &Arc<ContactSet>,
        known: &Known,
        forces: Vec<f64>,
    ) -> Result<Answer, SoftBodyError> {
        if self.load.as_ref().is_none_or(|(kept, _)| *kept != forces) {
            let column = Arc::new(LoadColumn::try_new(&self.base, &forces)?);
            self.load = Some((forces, column));
            self.loaded = None;
        }
        let loads = self.load.iter().map(|(_, column)| UnitLoad::Forces(Arc::clone(column)));
        let base = &self.base;
        let loaded = self
            .loaded
            .get_or_insert_with(|| LoadedSet::new(base, Arc::clone(set), loads.collect()));
        let found = loaded.solve(&known.q_known, &[1.0])?;
        let displacements = loaded.wanted_displacements(&found);
        let delivery = Delivery::Double;
        let certificate = loaded.certify(base, &known.q_known, &found, &displacements, delivery);
        Ok(answer(known, displacements, &found.contact.lambda, certificate))
    }
}

fn answer(
    known: &Known,
    displacements: Vec<[f64; 3]>,
    forces: &[f64],
    certificate: Certificate,
) -> Answer {
    Answer {
        displacements: displacements.into_iter().map(Vector3::from).collect(),
        reactions: reactions(&known.dofs, forces),
        residual_rel: certificate.residual_rel,
        inexactness: match (certificate.error_bound_rel, certificate.error_estimate_rel) {
            (Ok(error), _) => Inexactness::Proven(error),
            (Err(_), Some(error)) => Inexactness::Estimated(error),
            (Err(reason), None) => Inexactness::Unknown(reason),
        },
    }
}
