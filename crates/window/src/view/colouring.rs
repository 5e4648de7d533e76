//! The colours of the object in a tick, with the legend that explains them.

use std::sync::Arc;

use softgrasp_core::fem::Material;

use super::colour_map::ColourMap;
use super::frame::ObjectView;
use super::legend::Legend;
use super::shaded_object::ShadedObject;
use super::shading::Shading;

/// Colours of an object, tick after tick.
pub struct Colouring {
    map: ColourMap,
    legend: Legend,
    shaded: Option<Shaded>,
    material: Material,
    shares: Vec<f64>,
    /// What the legend says besides its numbers.
    remark: String,
}

/// The legend of strain, stress and error ends above so large a share of the surface's nodes, and
/// not below so large a part of the highest value: the few highest values have one colour.
const COLOURED_SHARE: f64 = 0.9;
const COLOURED_PART: f64 = 0.6;

struct Shaded {
    /// Object and rest shape that it is made for, and its material where it has its own.
    of: (usize, u64, Option<Material>),
    object: ShadedObject,
}

impl Colouring {
    /// Colours for objects of a material.
    pub fn new(material: Material) -> Self {
        Self {
            map: ColourMap::new(),
            legend: Legend::new(Shading::Plain),
            shaded: None,
            material,
            shares: Vec::new(),
            remark: String::new(),
        }
    }

    /// Sets the material of the objects from now on.
    pub fn set_material(&mut self, material: Material) {
        self.material = material;
        self.shaded = None;
    }

    /// Works out the colours of the object in a tick.
    ///
    /// Units: `now_s` s on the clock of who looks.
    pub fn follow(&mut self, object: &ObjectView, shading: Shading, now_s: f64) {
        self.shares.clear();
        self.remark.clear();
        if self.legend.shading() != shading {
            self.legend = Legend::new(shading);
        }
        if shading == Shading::Plain {
            return;
        }
        let own = object.own.as_ref().map(|own| own.material);
        let of = (object.number, object.rest_shapes, own);
        if self.shaded.as_ref().is_none_or(|shaded| shaded.of != of) {
            let material = own.unwrap_or(self.material);
            let made = ShadedObject::new(Arc::clone(&object.rest), material);
            self.shaded = Some(Shaded { of, object: made });
        }
        let Some(Shaded { object: shaded, .. }) = &mut self.shaded else { return };
        if shading.needs_inside() && !object.whole {
            "waiting for an answer with the nodes inside".clone_into(&mut self.remark);
            return;
        }
        // A tick whose displacements are those of another mesh shows no colours.
        if shaded.shade(shading, &object.displacement).is_err() {
            return;
        }
        let largest = shaded.largest_seen();
        let coloured = match shading {
            Shading::Displacement | Shading::Plain => largest,
            Shading::Strain | Shading::VonMises | Shading::Error => {
                shaded.seen_by_share(COLOURED_SHARE).max(COLOURED_PART * largest)
            }
        };
        self.legend.follow(coloured, now_s);
        let legend = &self.legend;
        self.shares.extend(shaded.values().iter().map(|value| legend.fraction(*value)));
        if let Some(error) = shaded.error_of_whole() {
            let text = shading.text(error);
            self.remark = format!("whole object, energy norm: {text} (an estimate, no bound)");
        } else if largest > legend.most() {
            self.remark = format!("highest: {}", legend.unit().text(largest));
        }
    }

    /// Share of the legend's range at each node; empty where nothing is coloured.
    pub fn shares(&self) -> &[f64] {
        &self.shares
    }

    /// The colour map.
    pub fn map(&self) -> &ColourMap {
        &self.map
    }

    /// The legend of the colours.
    pub fn legend(&self) -> &Legend {
        &self.legend
    }

    /// What the legend says besides its numbers; empty if nothing.
    pub fn remark(&self) -> &str {
        &self.remark
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::frame::samples::frame;

    #[test]
    fn legend_of_strain_does_not_end_at_a_third_of_the_highest() {
        let mut colouring = Colouring::new(Material::try_new(2.0e4, 0.4).unwrap());
        let mut object = frame(1).object;
        // One corner is pulled out: a few nodes are strained much, the others not.
        object.displacement[0] = object.rest.mesh().vertices()[0].coords.map(|x| 0.2 * x).into();
        for shading in [Shading::Strain, Shading::VonMises] {
            colouring.follow(&object, shading, 0.0);
            let most = colouring.shares().iter().copied().fold(0.0, f64::max);
            assert!(most > 0.3 && most <= 1.0 / COLOURED_PART + 1e-9, "{shading}: {most}");
            assert_eq!(most > 1.0, colouring.remark().starts_with("highest: "), "{shading}");
        }
    }

    #[test]
    fn stress_of_one_of_several_objects_is_that_of_its_own_material() {
        use crate::view::frame::OwnLook;
        use crate::view::object_skin::Look;

        let soft = Material::try_new(2.0e4, 0.4).unwrap();
        let mut object = frame(1).object;
        let bend = |p: &nalgebra::Point3<f64>| [0.02 * p.y, 0.0, 0.0];
        object.displacement = object.rest.mesh().vertices().iter().map(bend).collect();
        let largest = |young: f64| {
            let material = Material::try_new(young, 0.4).unwrap();
            let own = OwnLook { name: "cube".into(), look: Look::Cube, material };
            let object = ObjectView { number: 1, own: Some(own), ..object.clone() };
            let mut colouring = Colouring::new(soft);
            colouring.follow(&object, Shading::VonMises, 0.0);
            colouring.legend().most()
        };
        let ratio = largest(2.0e5) / largest(2.0e4);
        assert!((5.0..20.0).contains(&ratio), "ten times as stiff: {ratio} times the stress");
    }
}
