//! Regions of an object's mesh that are of another material than its body: a pit in a peach.

use softgrasp_core::fem::Material;

/// Names of the regions of a mesh, and the materials of those that have one of their own.
///
/// Shapes: one entry per region number of the mesh; none for a mesh of one region.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Regions {
    names: Vec<String>,
    own: Vec<Option<Material>>,
}

impl Regions {
    /// Regions with these names, all of the body's material.
    pub fn named(names: Vec<String>) -> Self {
        Self { own: vec![None; names.len()], names }
    }

    /// Names of the regions, by their numbers.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Adds a region of a material of its own; its number.
    pub fn add(&mut self, name: String, material: Material) -> u32 {
        self.names.push(name);
        self.own.push(Some(material));
        self.names.len() as u32 - 1
    }

    /// Gives a region a material of its own.
    ///
    /// # Panics
    /// On a region that is not there.
    pub fn set(&mut self, region: u32, material: Material) {
        self.own[region as usize] = Some(material);
    }

    /// Whether no region has a material of its own.
    pub fn are_of_one_material(&self) -> bool {
        self.own.iter().all(Option::is_none)
    }

    /// Materials by region number, where some region has its own; else that of the body alone.
    ///
    /// Shapes: one, or one per region.
    pub fn materials(&self, body: Material) -> Vec<Material> {
        if self.are_of_one_material() {
            return vec![body];
        }
        self.own.iter().map(|own| own.unwrap_or(body)).collect()
    }

    /// Largest Poisson's ratio of body and regions, which decides what element does not lock.
    pub fn largest_poisson(&self, body: f64) -> f64 {
        self.own.iter().flatten().map(Material::poisson).fold(body, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_without_a_material_of_their_own_are_of_that_of_the_body() {
        let (flesh, stone) =
            (Material::try_new(2e4, 0.4).unwrap(), Material::try_new(1e9, 0.2).unwrap());
        let mut regions = Regions::named(vec!["flesh".to_owned(), "skin".to_owned()]);
        assert_eq!(regions.materials(flesh), [flesh]);
        assert_eq!(regions.add("stone".to_owned(), stone), 2);
        assert_eq!(regions.materials(flesh), [flesh, flesh, stone]);
        regions.set(1, stone);
        assert_eq!(regions.materials(flesh), [flesh, stone, stone]);
        assert_eq!(regions.largest_poisson(0.3), 0.3);
        assert_eq!(regions.largest_poisson(0.1), 0.2);
    }
}
