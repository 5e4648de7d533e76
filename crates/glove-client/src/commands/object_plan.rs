//! What a run says of each of its objects: what it is, of what it is made, and where it lies.

use anyhow::{Context, bail};
use softgrasp_core::fem::Material as ElasticMaterial;
use softgrasp_grasp::object::ObjectChoice;
use softgrasp_hand::hand_setup::HandSetup;
use softgrasp_protocol::{ElementChoice, ElementName, Material, MethodName};
use softgrasp_window::view::object_skin::Look;

use super::contact_arguments::GraspRule;
use crate::ask::solve_settings::{Elasticity, SolveSettings, Subscription, element_for_frames};
use crate::object::loading::ObjectRequest;
use crate::object::region_choice::RegionChoice;
use crate::object::scene::{NODES_DEFAULT, SceneFile, size_to_hold};
use crate::object::scene_objects::SceneEntry;
use crate::run::contact_grasp::ContactScene;

/// Flags that are of every object of a run.
pub(super) struct ObjectFlags<'a> {
    /// Object that was named; `None` leaves it to the scene.
    pub(super) object: Option<&'a ObjectChoice>,
    pub(super) nodes: Option<usize>,
    pub(super) size_m: Option<f64>,
    pub(super) young: Option<f64>,
    pub(super) poisson: Option<f64>,
    pub(super) element: Option<ElementChoice>,
    pub(super) regions: &'a [RegionChoice],
    pub(super) method: MethodName,
    pub(super) subscription: Subscription,
    pub(super) max_error: Option<f64>,
}

/// Plan of one object of a run.
#[derive(Clone)]
pub(super) struct ObjectPlan {
    /// Built-in object or file.
    pub(super) object: ObjectChoice,
    /// Number of nodes of a built-in object.
    pub(super) nodes: usize,
    /// Longest extent of the object, m; `None` where the hand may choose it.
    pub(super) size_m: Option<f64>,
    /// Regions of a material of their own.
    pub(super) regions: Vec<RegionChoice>,
    /// Material, and settings of the solves.
    pub(super) settings: SolveSettings,
    /// Constants of its grasp by friction; `None` for the thesis's rules.
    pub(super) contact_scene: Option<ContactScene>,
}

/// What one of several objects is painted as, and where it lies.
#[derive(Clone, Default)]
pub(super) struct Laying {
    /// Name of the look; `None` takes that of the object.
    look: Option<String>,
    /// Place of its origin on the table, m; `None` leaves it to the table.
    pub(super) at_m: Option<[f64; 2]>,
}

impl Laying {
    /// What an entry of a scene says.
    ///
    /// # Errors
    /// A look that is none.
    pub(super) fn of(entry: &SceneEntry) -> anyhow::Result<Self> {
        if let Some(look) = entry.look.as_deref().filter(|look| !LOOKS.contains(look)) {
            bail!("the look of {} is '{look}'; there are {}", entry.shape, LOOKS.join(", "));
        }
        Ok(Self { look: entry.look.clone(), at_m: entry.at_m })
    }

    /// Look of an object.
    pub(super) fn look(&self, object: &ObjectChoice) -> Look {
        self.look.as_deref().map_or_else(|| Look::of(&object.to_string()), Look::of)
    }
}

/// Names of the looks.
const LOOKS: [&str; 5] = ["cube", "sphere", "strawberry", "toothpaste", "clay"];

impl ObjectFlags<'_> {
    /// Plan of an object: flags win over the scene.
    ///
    /// # Errors
    /// Names in the scene that are none, and settings that do not go together.
    pub(super) fn plan(
        &self,
        scene: &SceneFile,
        rule: GraspRule,
        elasticity: Elasticity,
    ) -> anyhow::Result<ObjectPlan> {
        let object = match (self.object, scene.object()) {
            (Some(choice), _) => choice.clone(),
            (None, Some(name)) => name.parse()?,
            (None, None) => "strawberry".parse()?,
        };
        let element = match (self.element, &scene.element) {
            (Some(element), _) => element,
            (None, Some(name)) => name.parse().context("the scene's element")?,
            (None, None) => ElementChoice::Auto,
        };
        let material = Material {
            young: self.young.or(scene.young_pa).unwrap_or(2.0e4),
            poisson: self.poisson.or(scene.poisson).unwrap_or(0.4),
        };
        // Flags have been checked; what is wrong here stands in the scene file.
        ElasticMaterial::try_new(material.young, material.poisson)
            .context("the scene's material")?;
        let regions = self.chosen_regions(scene)?;
        let largest = regions.iter().map(|region| region.poisson).fold(material.poisson, f64::max);
        let size_m = self.size_m.or(scene.object_size_m).or_else(|| size_to_hold(&object));
        Ok(ObjectPlan {
            object,
            nodes: self.nodes.or(scene.nodes).unwrap_or(NODES_DEFAULT),
            size_m,
            regions,
            settings: SolveSettings {
                material,
                element: chosen_element(element, largest),
                method: self.method.clone(),
                contact: rule.contact,
                subscription: self.subscription,
                elasticity,
                max_error: self.max_error,
            },
            contact_scene: rule.scene,
        })
    }

    /// Regions of flags and scene; a flag wins over the scene's region of its name, whose place it keeps.
    fn chosen_regions(&self, scene: &SceneFile) -> anyhow::Result<Vec<RegionChoice>> {
        let mut regions = scene.region.clone();
        for region in self.regions {
            match regions.iter_mut().find(|known| known.name == region.name) {
                Some(known) => {
                    (known.young_pa, known.poisson) = (region.young_pa, region.poisson);
                }
                None => regions.push(region.clone()),
            }
        }
        // Flags have been checked; what is wrong here stands in the scene file.
        regions.iter().try_for_each(|region| region.material().map(drop)).context("the scene")?;
        Ok(regions)
    }
}

impl ObjectPlan {
    /// Request for the object, with the hand that is to grasp it.
    pub(super) fn request(&self, setup: &HandSetup) -> ObjectRequest {
        ObjectRequest {
            choice: self.object.clone(),
            nodes: self.nodes,
            size_m: self.size_m,
            regions: self.regions.clone(),
            setup: setup.clone(),
            contact: self.settings.contact,
            element: self.settings.element,
        }
    }
}

/// Element for the ticks.
fn chosen_element(choice: ElementChoice, poisson: f64) -> ElementName {
    match choice {
        ElementChoice::T4 => ElementName::T4,
        ElementChoice::T4Anp => ElementName::T4Anp,
        ElementChoice::T10 => ElementName::T10,
        ElementChoice::Auto => element_for_frames(poisson),
    }
}
