//! The scene: everything that is seen of a tick, and how it follows the next one.

use std::collections::BTreeMap;

use kiss3d::prelude::{SceneNode3d, Window};
use nalgebra::Point3;
use softgrasp_grasp::hand::Finger;
use softgrasp_grasp::shape::Sphere;

use super::drawn_hand::DrawnHand;
use super::drawn_marks::DrawnMarks;
use super::drawn_object::DrawnObject;
use super::drawn_spheres::{DrawnSpheres, Visit};
use super::stage::Stage;
use crate::view::colouring::Colouring;
use crate::view::display::{Display, Level, Spheres};
use crate::view::frame::{ObjectView, ViewFrame};
use crate::view::ground_shade::capsules;
use crate::view::light::GROUND_M;
use crate::view::object_skin::Look;

/// A scene on the graphics card.
pub struct Scene {
    root: SceneNode3d,
    stage: Stage,
    /// The objects by their number.
    objects: BTreeMap<usize, DrawnObject>,
    hands: [Option<DrawnHand>; 2],
    marks: DrawnMarks,
    spheres: DrawnSpheres,
    look: Look,
}

impl Scene {
    /// A scene with a stage and nothing on it.
    pub fn new(window: &mut Window) -> Self {
        let mut root = SceneNode3d::empty();
        let stage = Stage::new(window, &mut root);
        let (marks, spheres) = (DrawnMarks::new(&mut root), DrawnSpheres::new(&mut root));
        Self {
            root,
            stage,
            objects: BTreeMap::new(),
            hands: [None, None],
            marks,
            spheres,
            look: Look::Imported,
        }
    }

    /// Sets the look of the next object.
    pub fn set_look(&mut self, look: Look) {
        self.look = look;
    }

    /// Root node of the scene.
    pub fn root(&mut self) -> &mut SceneNode3d {
        &mut self.root
    }

    /// Force that a metre of arrow stands for, N/m.
    pub fn newtons_per_m(&self) -> f64 {
        self.marks.newtons_per_m()
    }

    /// Shows a tick.
    pub fn follow(
        &mut self,
        window: &mut Window,
        frame: &ViewFrame,
        display: &Display,
        colouring: &Colouring,
    ) {
        let mut is_new = self.stage.set_level(window, display.level);
        let shape = frame.shape();
        let object = &frame.object;
        self.stage.set_ground(object.table_y.unwrap_or(GROUND_M));
        is_new |= self.follow_object(window, object, &shape, display, Some(colouring));
        for other in &frame.others {
            is_new |= self.follow_object(window, other, &other.shape(), display, None);
        }
        is_new |= self.follow_hands(frame, display);
        let spheres = shown_spheres(frame, &shape, display.spheres);
        is_new |= self.spheres.show(&object.world_from_object, &spheres);
        if is_new {
            self.stage.dress(&mut self.root);
        }
        if display.level == Level::Plain {
            self.stage.shade_ground(capsules(frame, &shape, display.skin));
        }
        self.marks.follow(frame, &shape, display.contacts, display.forces);
    }

    /// Moves an object to a tick, with its colours if it is the one that has them; returns whether it is
    /// another object than before.
    fn follow_object(
        &mut self,
        window: &mut Window,
        object: &ObjectView,
        shape: &[Point3<f64>],
        display: &Display,
        colouring: Option<&Colouring>,
    ) -> bool {
        let drawn = self.objects.get_mut(&object.number);
        let is_new = drawn.is_none_or(|drawn| !drawn.is(object));
        if is_new {
            if let Some(before) = self.objects.remove(&object.number) {
                before.remove();
            }
            let look = object.own.as_ref().map_or(self.look, |own| own.look);
            let made = DrawnObject::new(&mut self.root, look, object);
            self.objects.insert(object.number, made);
        }
        if let Some(drawn) = self.objects.get_mut(&object.number) {
            drawn.follow(object, shape);
            drawn.show_ghost(display.ghost);
            drawn.colour_by(colouring);
            if display.wireframe {
                drawn.draw_wireframe(window);
            }
        }
        is_new
    }

    /// Moves the hands to a tick; returns whether one of them is another hand than before.
    fn follow_hands(&mut self, frame: &ViewFrame, display: &Display) -> bool {
        let mut is_new = false;
        for (drawn, hand) in self.hands.iter_mut().zip([&frame.hand, &frame.second_hand]) {
            let Some(hand) = hand else { continue };
            if let Some(before) = drawn.take_if(|drawn| !drawn.fits(hand)) {
                before.remove();
            }
            is_new |= drawn.is_none();
            let drawn = drawn.get_or_insert_with(|| DrawnHand::new(&mut self.root, hand));
            drawn.follow(hand);
            drawn.show(display.skin, display.colliders);
        }
        is_new
    }
}

/// Spheres of the tree around the shape as it is, with their colours.
fn shown_spheres(
    frame: &ViewFrame,
    shape: &[Point3<f64>],
    spheres: Spheres,
) -> Vec<(Sphere, Visit)> {
    if spheres == Spheres::Hidden {
        return Vec::new();
    }
    let mut tree = frame.object.rest.tree().clone();
    // A shape that the tree cannot follow is no shape that is shown.
    if tree.refit(shape).is_err() {
        return Vec::new();
    }
    match (spheres, &frame.hand) {
        (Spheres::Level(level), _) => {
            let shown = tree.spheres_at_level(level).into_iter();
            shown.map(|sphere| (sphere, Visit::Passed)).collect()
        }
        (Spheres::Search, Some(hand)) => {
            let object_from_world = frame.object.world_from_object.inverse();
            let hand = hand.colliders().in_frame(&object_from_world);
            let visited = tree.visited_by_sphere(&hand.finger(Finger::Index).tip);
            let visit = |overlaps| if overlaps { Visit::Entered } else { Visit::Passed };
            // The outermost hide everything, and everybody knows them.
            let inner = visited.into_iter().filter(|visited| visited.level >= 2);
            inner.map(|visited| (visited.sphere, visit(visited.overlaps))).collect()
        }
        (Spheres::Hidden | Spheres::Search, _) => Vec::new(),
    }
}
