//! What the pictures show: the scene with its light and colours, and the eye that sees it.

use std::sync::Arc;

use kiss3d::prelude::{OrbitCamera3d, SceneNode3d, Window};
use softgrasp_hand::hand_request::HandChoice;

use super::director::Director;
use super::scene::Scene;
use super::stage::{drawn_camera, place_camera};
use crate::view::camera::ViewCamera;
use crate::view::colouring::Colouring;
use crate::view::display::Display;
use crate::view::eye_place::EyePlace;
use crate::view::frame::{ObjectView, ViewFrame};
use crate::view::shading::Shading;

/// What the pictures show: scene, light, colours and eye.
pub(super) struct ShownView {
    scene: Scene,
    drawn_camera: OrbitCamera3d,
    camera: ViewCamera,
    eye_place: EyePlace,
    /// Chooses what the person leaves to the window.
    director: Director,
    pub(super) display: Display,
    pub(super) colouring: Colouring,
}

impl ShownView {
    /// A view of the scene; the director has what the person has not chosen.
    pub(super) fn new(
        scene: Scene,
        camera: ViewCamera,
        display: Display,
        colouring: Colouring,
        (eye_is_chosen, shading_is_chosen): (bool, bool),
    ) -> Self {
        Self {
            scene,
            drawn_camera: drawn_camera(),
            camera,
            eye_place: if eye_is_chosen { EyePlace::Taken } else { EyePlace::AtOnce },
            director: Director::new(eye_is_chosen, shading_is_chosen),
            display,
            colouring,
        }
    }

    pub(super) fn scene(&self) -> &Scene {
        &self.scene
    }

    pub(super) fn scene_mut(&mut self) -> &mut Scene {
        &mut self.scene
    }

    pub(super) fn camera(&self) -> &ViewCamera {
        &self.camera
    }

    /// The root of the scene, and the camera that draws it.
    pub(super) fn drawing(&mut self) -> (&mut SceneNode3d, &mut OrbitCamera3d) {
        place_camera(&mut self.drawn_camera, &self.camera);
        (self.scene.root(), &mut self.drawn_camera)
    }

    /// Moves the eye as the person wishes; if it moves, the person has it from now on.
    pub(super) fn move_eye<T>(&mut self, change: impl FnOnce(&mut ViewCamera) -> T) -> T {
        let before = self.camera;
        let changed = change(&mut self.camera);
        if self.camera != before {
            self.director.eye_is_chosen();
        }
        changed
    }

    /// Places the eye so that it sees all of the object of a tick.
    pub(super) fn frame_all(&mut self, frame: &ViewFrame) {
        let spheres: Vec<_> = frame.objects().map(ObjectView::ball).collect();
        // The middle of the outermost, and as far as the farthest reaches.
        let (mut low, mut high) = (spheres[0].0, spheres[0].0);
        for (centre, _) in &spheres {
            (low, high) = (low.inf(centre), high.sup(centre));
        }
        let middle = nalgebra::center(&low, &high);
        let reach = spheres.iter().map(|(centre, radius)| (centre - middle).norm() + radius);
        let radius = reach.fold(0.0, f64::max);
        self.director.eye_is_chosen();
        self.camera.frame(middle, 1.7 * radius);
    }

    /// Prepares for another object: the eye goes to where it will be, unless the person has it.
    pub(super) fn meet_object(&mut self, newest: Option<&Arc<ViewFrame>>) {
        if let (Some(frame), true) = (newest, self.director.has_eye()) {
            self.eye_place = EyePlace::after(frame);
        }
    }

    /// Sets the quantity that the colours show, as the person chooses.
    pub(super) fn shade(&mut self, shading: Option<Shading>) {
        match shading {
            Some(shading) => self.display.shading = shading,
            None => self.display.next_shading(),
        }
        self.director.shading_is_chosen();
    }

    /// Chooses eye and colours for a tick, as far as they are left to the window; returns whether answers
    /// are to hold the nodes inside.
    pub(super) fn direct(&mut self, frame: &ViewFrame, hand: Option<HandChoice>) -> bool {
        if frame.acts.squeezing.is_some() {
            self.eye_place = EyePlace::Taken;
        }
        let placed = self.director.eye(frame, self.camera);
        if let Some(eye) = placed.or_else(|| self.eye_place.eye(frame)) {
            self.camera = eye;
        }
        let is_directed = matches!(hand, Some(HandChoice::Scripted(_) | HandChoice::Mouse));
        if let Some(shading) = self.director.shading(frame, is_directed) {
            self.display.shading = shading;
        }
        self.display.shading.needs_inside() || (is_directed && self.director.directs_colours(frame))
    }

    /// Shows a tick.
    pub(super) fn follow(&mut self, window: &mut Window, frame: &ViewFrame) {
        self.colouring.follow(&frame.object, self.display.shading, frame.at_s);
        self.scene.follow(window, frame, &self.display, &self.colouring);
    }
}
