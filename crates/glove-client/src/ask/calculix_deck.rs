//! One question as an input deck of CalculiX or Abaqus, so that another program can check an answer.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use nalgebra::Point3;
use softgrasp_core::fem::{Element, QuadraticMesh, QuadraticMeshError, tet10};
use softgrasp_core::mesh::TetMesh;
use softgrasp_protocol::{DofValue, LawName, Material};

/// Question to be written as an input deck.
///
/// Units: m, N, Pa.
pub struct CalculixDeck<'a> {
    /// Nodes, and corners of the elements.
    pub mesh: &'a TetMesh,
    /// Element: `t4` (C3D4) or `t10` (C3D10); others have no counterpart.
    pub element: Element,
    /// Of the whole mesh, or one for each region that has elements, in ascending order of the regions' numbers.
    pub materials: &'a [Material],
    /// Law of large deformation; `None` for linear elasticity.
    pub law: Option<LawName>,
    /// Known displacements (Dirichlet values), m.
    pub known: &'a [DofValue],
    /// Forces on degrees of freedom, N; they keep their directions.
    pub forces: &'a [DofValue],
}

/// Why a question cannot be written as a deck.
#[derive(Debug, thiserror::Error)]
pub enum DeckError {
    /// CalculiX and Abaqus have no such element.
    #[error("a deck is for t4 (C3D4) or t10 (C3D10); CalculiX has no {}", element.name())]
    Element {
        /// Element of the question.
        element: Element,
    },
    /// CalculiX and Abaqus have no such law.
    #[error("a deck is for the law neo-hookean; CalculiX has no {law}")]
    Law {
        /// Law of the question.
        law: LawName,
    },
    /// The mesh has too many nodes for mid-edge nodes, or its own do not fit together.
    #[error(transparent)]
    Mesh(#[from] QuadraticMeshError),
}

/// Nodes and elements as CalculiX counts them.
struct Cells {
    vertices: Vec<Point3<f64>>,
    /// Nodes of every element in CalculiX's order, from 0.
    tets: Vec<Vec<u32>>,
    used: Vec<bool>,
    name: &'static str,
}

impl CalculixDeck<'_> {
    /// The deck: nodes count from 1 in the order of the mesh; mid-edge nodes that it does not bring along
    /// follow and are free.
    ///
    /// A question of large deformation is answered in increments (NLGEOM) with C₁₀ = μ/2 and
    /// D₁ = 2/κ, which is the law `neo-hookean`.
    ///
    /// # Errors
    /// [`DeckError`] for elements and laws without a counterpart.
    pub fn text(&self) -> Result<String, DeckError> {
        let cells = Cells::of(self.mesh, self.element)?;
        let mut text = cells.cards();
        match self.materials {
            [only] => self.section_cards(&mut text, *only, "BODY", "SOFT")?,
            several => self.region_cards(&mut text, several)?,
        }
        // Far below the digits that are printed.
        text.push_str(match self.law {
            Some(_) => {
                "*STEP, NLGEOM, INC=1000\n*STATIC\n0.1,1.,1e-6,0.1\n\
                 *CONTROLS, PARAMETERS=FIELD\n1e-9,1e-9\n"
            }
            None => "*STEP\n*STATIC\n",
        });
        text.push_str("*BOUNDARY\n");
        for &DofValue { dof, value } in self.known {
            let (node, axis) = (dof / 3 + 1, dof % 3 + 1);
            line(&mut text, format_args!("{node},{axis},{axis},{}", card(value)));
        }
        if !self.forces.is_empty() {
            text.push_str("*CLOAD\n");
        }
        for &DofValue { dof, value } in self.forces {
            line(&mut text, format_args!("{},{},{}", dof / 3 + 1, dof % 3 + 1, card(value)));
        }
        // The end of the step only.
        text.push_str("*NODE PRINT, NSET=ALL, FREQUENCY=100000\nU, RF\n*END STEP\n");
        Ok(text)
    }

    /// A set of elements, a material and a section for each region.
    fn region_cards(&self, text: &mut String, materials: &[Material]) -> Result<(), DeckError> {
        let numbers: BTreeSet<u32> = self.mesh.regions().iter().copied().collect();
        for (place, (number, material)) in numbers.into_iter().zip(materials).enumerate() {
            let set = format!("REGION{place}");
            line(text, format_args!("*ELSET, ELSET={set}"));
            let of_region = self.mesh.regions().iter().zip(1..).filter(|(r, _)| **r == number);
            of_region.for_each(|(_, element)| line(text, format_args!("{element},")));
            self.section_cards(text, *material, &set, &format!("SOFT{place}"))?;
        }
        Ok(())
    }

    /// A material, and the elements that are of it.
    fn section_cards(
        &self,
        text: &mut String,
        material: Material,
        set: &str,
        name: &str,
    ) -> Result<(), DeckError> {
        let Material { young, poisson } = material;
        line(text, format_args!("*MATERIAL, NAME={name}"));
        match self.law {
            None => line(text, format_args!("*ELASTIC\n{},{}", card(young), card(poisson))),
            Some(LawName::NeoHookean) => {
                let c10 = young / (4.0 * (1.0 + poisson));
                let d1 = 6.0 * (1.0 - 2.0 * poisson) / young;
                let cards = format!("{},{}", card(c10), card(d1));
                line(text, format_args!("*HYPERELASTIC, NEO HOOKE\n{cards}"));
            }
            Some(law) => return Err(DeckError::Law { law }),
        }
        line(text, format_args!("*SOLID SECTION, ELSET={set}, MATERIAL={name}"));
        Ok(())
    }
}

impl Cells {
    fn of(mesh: &TetMesh, element: Element) -> Result<Self, DeckError> {
        match element {
            Element::Tet4 => Ok(Self {
                vertices: mesh.vertices().to_vec(),
                tets: mesh.tets().iter().map(|&[a, b, c, d]| vec![a, b, d, c]).collect(),
                used: mesh.is_corner(),
                name: "C3D4",
            }),
            Element::Tet10 => {
                let quadratic = QuadraticMesh::try_new(mesh)?;
                let turned = |t: &[u32; 10]| tet10::MIRRORED.map(|local| t[local]).to_vec();
                Ok(Self {
                    vertices: quadratic.vertices().to_vec(),
                    tets: quadratic.tets().iter().map(turned).collect(),
                    used: quadratic.used_nodes(),
                    name: "C3D10",
                })
            }
            element => Err(DeckError::Element { element }),
        }
    }

    fn cards(&self) -> String {
        let mut text = String::from("*NODE, NSET=ALL\n");
        let used = self.vertices.iter().zip(1..).zip(&self.used).filter(|(_, used)| **used);
        for ((p, node), _) in used {
            let [x, y, z] = [p.x, p.y, p.z].map(card);
            line(&mut text, format_args!("{node},{x},{y},{z}"));
        }
        line(&mut text, format_args!("*ELEMENT, TYPE={}, ELSET=BODY", self.name));
        for (nodes, element) in self.tets.iter().zip(1..) {
            let nodes: String = nodes.iter().map(|n| format!(",{}", n + 1)).collect();
            line(&mut text, format_args!("{element}{nodes}"));
        }
        text
    }
}

fn line(text: &mut String, words: std::fmt::Arguments<'_>) {
    writeln!(text, "{words}").expect("a string takes everything");
}

/// Number of characters of a number that CalculiX reads; it ignores further ones.
const CARD: usize = 20;

/// Number as exactly as a card holds it: at least fourteen digits (below 1e100).
fn card(x: f64) -> String {
    let exact = format!("{x:e}");
    if exact.len() <= CARD {
        return exact;
    }
    let mut rounded = (0..17).rev().map(|decimals| format!("{x:.decimals$e}"));
    rounded.find(|text| text.len() <= CARD).expect("one digit fits")
}

#[cfg(test)]
mod tests {
    use softgrasp_core::mesh::{BuiltIn, generate};

    use super::*;

    fn deck(element: Element, law: Option<LawName>) -> Result<String, DeckError> {
        let mesh = generate(BuiltIn::Cube, 27).unwrap();
        let known = [DofValue { dof: 4, value: 1e-3 }];
        let forces = [DofValue { dof: 8, value: -0.5 }];
        let materials = &[Material { young: 6e4, poisson: 0.25 }];
        CalculixDeck { mesh: &mesh, element, materials, law, known: &known, forces: &forces }.text()
    }

    #[test]
    fn numbers_fit_their_cards_with_fourteen_digits() {
        for x in [0.0, 1.0, -1.0 / 3.0, 2e5 / 3.0, -1e-98 / 3.0, 1e7 / 7.0] {
            let text = card(x);
            assert!(text.len() <= CARD, "{text}");
            let back: f64 = text.parse().unwrap();
            assert!((back - x).abs() <= 5e-14 * x.abs(), "{x:e} became {text}");
        }
    }

    #[test]
    fn known_displacements_and_forces_stand_at_their_nodes_and_axes() {
        let text = deck(Element::Tet4, None).unwrap();
        assert!(text.contains("*ELASTIC\n6e4,2.5e-1\n"), "{text}");
        assert!(text.contains("*BOUNDARY\n2,2,2,1e-3\n*CLOAD\n3,3,-5e-1\n"), "{text}");
        assert!(text.contains("TYPE=C3D4"), "{text}");
    }

    #[test]
    fn every_region_has_its_elements_its_material_and_its_section() {
        let cube = generate(BuiltIn::Cube, 27).unwrap();
        // Region 1 has no element: it has no material either.
        let regions = (0..cube.tets().len()).map(|tet| if tet < 2 { 2 } else { 0 }).collect();
        let mesh = softgrasp_core::mesh::TetMesh::try_new(
            cube.vertices().to_vec(),
            cube.tets().to_vec(),
            regions,
        );
        let deck = CalculixDeck {
            mesh: &mesh.unwrap(),
            element: Element::Tet4,
            materials: &[
                Material { young: 1e4, poisson: 0.25 },
                Material { young: 2e6, poisson: 0.5 / 4.0 },
            ],
            law: None,
            known: &[],
            forces: &[],
        };
        let text = deck.text().unwrap();
        let stone = "*ELSET, ELSET=REGION1\n1,\n2,\n*MATERIAL, NAME=SOFT1\n*ELASTIC\n2e6,1.25e-1\n\
                     *SOLID SECTION, ELSET=REGION1, MATERIAL=SOFT1\n";
        assert!(text.contains(stone), "{text}");
        assert!(text.contains("*ELSET, ELSET=REGION0\n3,\n4,\n"), "{text}");
    }

    #[test]
    fn large_deformation_has_its_law_and_its_increments() {
        let text = deck(Element::Tet10, Some(LawName::NeoHookean)).unwrap();
        // μ/2 = E/4(1+ν) and 2/κ = 6(1−2ν)/E.
        assert!(text.contains("*HYPERELASTIC, NEO HOOKE\n1.2e4,5e-5\n"), "{text}");
        assert!(text.contains("NLGEOM") && text.contains("TYPE=C3D10"), "{text}");
    }

    #[test]
    fn what_the_other_program_has_not_is_named() {
        let element = deck(Element::Tet4Anp, None).unwrap_err().to_string();
        assert!(element.contains("t4-anp"), "{element}");
        let law = deck(Element::Tet4, Some(LawName::NeoHookeanLog)).unwrap_err().to_string();
        assert!(law.contains("neo-hookean-log"), "{law}");
    }
}
