//! Several objects of a scene file: `[[object]]`, each with what it has of its own.

use serde::de::value::SeqAccessDeserializer;
use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use softgrasp_grasp::object::ObjectChoice;

use crate::object::region_choice::RegionChoice;

/// One of several objects of a scene; what it leaves out is that of the scene.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct SceneEntry {
    /// cube, sphere, strawberry, toothpaste, or a file of a mesh or a surface (relative to the scene
    /// file).
    pub shape: String,
    /// Place of its origin on the table, m: to the right, toward the user. The first object lies in the
    /// middle.
    pub at_m: Option<[f64; 2]>,
    /// What it is painted as: cube, sphere, strawberry, toothpaste or clay; its shape if nothing is said.
    pub look: Option<String>,
    /// Number of nodes of a built-in object, or of a surface that is filled.
    pub nodes: Option<usize>,
    /// Longest extent, m; a mesh file is scaled to it.
    pub size_m: Option<f64>,
    /// Young's modulus, Pa.
    pub young_pa: Option<f64>,
    /// Poisson's ratio.
    pub poisson: Option<f64>,
    /// Name of the element: t4, t4-anp or auto.
    pub element: Option<String>,
    /// Coefficient of friction of hand and table on it.
    pub friction: Option<f64>,
    /// Density, kg/m³.
    pub density_kg_m3: Option<f64>,
    /// Equations of the deformation: linear, large or auto.
    pub deformation: Option<String>,
    /// Law of large deformation: neo-hookean or neo-hookean-log.
    pub material: Option<String>,
    /// Yield stress, Pa.
    pub yield_pa: Option<f64>,
    /// Regions of a material of their own.
    pub region: Vec<RegionChoice>,
}

impl SceneEntry {
    /// An object of which nothing else is said.
    pub fn of(object: &ObjectChoice) -> Self {
        Self { shape: object.to_string(), ..Self::default() }
    }
}

/// The key `object` of a scene: the name of one object, or a list of several.
#[derive(Clone, Debug, PartialEq)]
pub enum SceneObjects {
    /// One object: a built-in one or a file.
    One(String),
    /// Several objects on one table.
    Several(Vec<SceneEntry>),
}

impl<'de> Deserialize<'de> for SceneObjects {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ObjectsVisitor)
    }
}

struct ObjectsVisitor;

impl<'de> Visitor<'de> for ObjectsVisitor {
    type Value = SceneObjects;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("the name of an object, or tables [[object]] with a shape each")
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<SceneObjects, E> {
        Ok(SceneObjects::One(name.to_owned()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<SceneObjects, A::Error> {
        let entries = Vec::<SceneEntry>::deserialize(SeqAccessDeserializer::new(list))?;
        match entries.iter().position(|entry| entry.shape.is_empty()) {
            Some(at) => Err(A::Error::custom(format!("object {} has no shape", at + 1))),
            None if entries.is_empty() => Err(A::Error::custom("the list of objects is empty")),
            None => Ok(SceneObjects::Several(entries)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Deserialize)]
    struct Scene {
        object: SceneObjects,
    }

    fn read(text: &str) -> Result<SceneObjects, String> {
        toml::from_str::<Scene>(text).map(|scene| scene.object).map_err(|e| e.to_string())
    }

    #[test]
    fn name_is_one_object_and_tables_are_several_with_what_they_have_of_their_own() {
        assert_eq!(read("object = \"cube\"").unwrap(), SceneObjects::One("cube".to_owned()));
        let text = "[[object]]\nshape = \"sphere\"\nsize_m = 0.05\n[[object]]\nshape = \"cube\"\n\
                    at_m = [0.2, 0.0]\n[[object.region]]\nname = \"pit\"\nyoung_pa = 1e6\npoisson = 0.3\n";
        let SceneObjects::Several(entries) = read(text).unwrap() else { panic!("one object") };
        let [sphere, cube] = &entries[..] else { panic!("{} objects", entries.len()) };
        assert_eq!(
            (sphere.shape.as_str(), sphere.size_m, sphere.at_m),
            ("sphere", Some(0.05), None)
        );
        assert_eq!((cube.at_m, cube.region.len()), (Some([0.2, 0.0]), 1));
    }

    #[test]
    fn what_is_no_list_of_objects_is_refused_with_its_reason() {
        for (text, expected) in [
            ("object = 3", "tables [[object]]"),
            ("object = []", "the list of objects is empty"),
            ("[[object]]\nshape = \"cube\"\n[[object]]\nsize_m = 0.1", "object 2 has no shape"),
            ("[[object]]\nshape = \"cube\"\ncolour = \"red\"", "colour"),
        ] {
            let said = read(text).unwrap_err();
            assert!(said.contains(expected), "{text}: {said}");
        }
    }
}
