//! Prepares the further objects of a run: each is loaded, laid on the table, and given a link of its own.

use anyhow::Context;
use nalgebra::Isometry3;
use softgrasp_grasp::grasp::Grasp;
use softgrasp_grasp::object::SoftObject;
use softgrasp_hand::hand_setup::HandSetup;
use softgrasp_hand::loaded_object::{LoadStage, LoadedObject};

use super::object_plan::Laying;
use super::run_plan::RunPlan;
use crate::ask::connection::Host;
use crate::ask::link::Link;
use crate::object::loading::load;
use crate::object::table_layout::{Footprint, Laid, lay_out};
use crate::pace::tick_budget::Priority;
use crate::run::contact_grasp::ContactScene;
use crate::run::further_report::FurtherReport;
use crate::run::grasp_loop::GraspLoop;
use crate::run::table_object::FurtherObject;

/// The further objects of a run, ready to be laid on the table.
pub(super) struct FurtherObjects {
    loaded: Vec<LoadedObject>,
    /// Place of the origin of each on the table (x, z), m.
    places: Vec<[f64; 2]>,
}

impl FurtherObjects {
    /// Loads the objects and finds their places beside the first.
    ///
    /// # Errors
    /// An object that cannot be loaded, or objects that would lie in each other.
    pub(super) fn load(
        plan: &RunPlan,
        setup: &HandSetup,
        first: &SoftObject,
        goes_on: impl Fn(LoadStage) -> bool,
    ) -> anyhow::Result<Self> {
        let loaded = plan.further.iter().enumerate().map(|(at, (object, _))| {
            let loaded = load(&object.request(setup), &goes_on);
            let loaded = loaded.with_context(|| format!("object {}", at + 2))?;
            loaded.context("the object was called off")
        });
        let loaded = loaded.collect::<anyhow::Result<Vec<LoadedObject>>>()?;
        let laid = |name: String, object: &SoftObject, laying: &Laying| Laid {
            name,
            footprint: Footprint::of(object.rest().vertices().iter().copied()),
            at_m: laying.at_m,
        };
        let mut all = vec![laid(plan.first.object.to_string(), first, &plan.first_laying)];
        for ((object, laying), loaded) in plan.further.iter().zip(&loaded) {
            all.push(laid(object.object.to_string(), &loaded.object, laying));
        }
        let places = lay_out(&all)?.into_iter().skip(1).collect();
        Ok(Self { loaded, places })
    }

    /// Object of a number, from 0, among all of the run; `None` for the first.
    pub(super) fn get(&self, number: usize) -> Option<&LoadedObject> {
        number.checked_sub(1).and_then(|at| self.loaded.get(at))
    }

    /// Remarks on how the objects were made.
    pub(super) fn notes(&self) -> impl Iterator<Item = &String> {
        self.loaded.iter().flat_map(|loaded| &loaded.summary.notes)
    }

    /// Lays the objects on the table of the first; returns their reports.
    ///
    /// # Errors
    /// Error of the operating system if it starts no thread.
    pub(super) fn lay(
        self,
        plan: &RunPlan,
        host: &Host,
        priority: Priority,
        grasp_loop: &mut GraspLoop,
    ) -> anyhow::Result<Vec<FurtherReport>> {
        let table_y = grasp_loop.contact_grasp().and_then(|contact| contact.scene().table_y);
        let (Some(table_y), false) = (table_y, plan.further.is_empty()) else {
            return Ok(Vec::new());
        };
        let look = plan.first_laying.look(&plan.first.object);
        grasp_loop.name_first(&plan.first.object.to_string(), look);
        let mut reports = Vec::new();
        let all = plan.further.iter().zip(self.loaded).zip(self.places);
        for (number, (((object, laying), loaded), [x, z])) in (2..).zip(all) {
            let link = Link::start(host.endpoint(), priority);
            let scene = object.contact_scene.unwrap_or_default();
            let height = table_y - loaded.object.rest_shape().bottom();
            let home = Isometry3::translation(x, height, z);
            reports.push(FurtherReport::new(number, loaded.summary, [x, height, z]));
            let laid = grasp_loop.lay_beside(FurtherObject {
                name: object.object.to_string(),
                look: laying.look(&object.object),
                object: loaded.object,
                grasp: Grasp::try_new(home, Grasp::RELEASE_MARGIN_M)?,
                link: link.context("cannot start the link to the server")?,
                settings: object.settings.clone(),
                scene: ContactScene { table_y: Some(table_y), ..scene },
            });
            laid.context("cannot start a thread beside the ticks")?;
        }
        Ok(reports)
    }
}
