//! Pictures without a window: the same scene, drawn into memory.

use image::RgbImage;
use kiss3d::prelude::{CanvasSetup, NumSamples, OrbitCamera3d, RayTracer, Window};
use softgrasp_core::fem::Material;

use super::environment::studio;
use super::graphics::{Graphics, NoGraphics};
use super::scene::Scene;
use super::stage::{drawn_camera, place_camera};
use crate::view::camera::ViewCamera;
use crate::view::colouring::Colouring;
use crate::view::display::Display;
use crate::view::frame::ViewFrame;
use crate::view::object_skin::Look;

/// Draws ticks into memory. The scene is dropped before the window that it is part of.
pub struct Pictures {
    scene: Scene,
    camera: OrbitCamera3d,
    window: Window,
    colouring: Colouring,
}

impl Pictures {
    /// Pictures of a size in pixels.
    ///
    /// # Errors
    /// [`NoGraphics`] where nothing on this machine can draw.
    pub fn try_new(
        width: u32,
        height: u32,
        look: Look,
        material: Material,
    ) -> Result<Self, NoGraphics> {
        Graphics::find()?;
        let setup =
            CanvasSetup { samples: NumSamples::Four, vsync: false, ..CanvasSetup::default() };
        let mut window = pollster::block_on(Window::new_headless_with_setup(width, height, setup));
        let mut scene = Scene::new(&mut window);
        scene.set_look(look);
        Ok(Self { scene, camera: drawn_camera(), window, colouring: Colouring::new(material) })
    }

    /// Whether the processor draws. Mesa's driver of that kind keeps some megabytes for each picture
    /// that is not drawn at the level `plain` (seen with 22.3).
    pub fn is_software(&self) -> bool {
        Graphics::in_use().is_software
    }

    /// The picture of a tick by tracing so many paths of light a pixel.
    pub fn trace(
        &mut self,
        frame: &ViewFrame,
        display: &Display,
        camera: &ViewCamera,
        paths: u32,
    ) -> RgbImage {
        self.follow(frame, display, camera);
        let Self { scene, camera, window, .. } = self;
        let mut tracer = RayTracer::new();
        tracer.set_max_bounces(5);
        tracer.set_environment_image(&studio());
        for _ in 0..paths {
            pollster::block_on(window.raytrace_3d(scene.root(), camera, &mut tracer));
        }
        window.snap_image()
    }

    /// The picture of a tick.
    pub fn draw(&mut self, frame: &ViewFrame, display: &Display, camera: &ViewCamera) -> RgbImage {
        self.follow(frame, display, camera);
        let Self { scene, camera, window, .. } = self;
        pollster::block_on(window.render_3d(scene.root(), camera));
        window.snap_image()
    }

    /// Makes everything ready for the picture of a tick.
    fn follow(&mut self, frame: &ViewFrame, display: &Display, camera: &ViewCamera) {
        self.colouring.follow(&frame.object, display.shading, frame.at_s);
        self.scene.follow(&mut self.window, frame, display, &self.colouring);
        place_camera(&mut self.camera, camera);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::display::Level;
    use crate::view::frame::samples::frame;
    use crate::view::frame::{ObjectView, OwnLook};
    use crate::view::shading::Shading;

    /// `None`, and a line that says so, where nothing can draw.
    fn pictures() -> Option<Pictures> {
        let material = Material::try_new(2.0e4, 0.4).unwrap();
        match Pictures::try_new(96, 64, Look::Imported, material) {
            Ok(pictures) => Some(pictures),
            Err(error) => {
                println!("skipped: {error}");
                None
            }
        }
    }

    #[test]
    fn colours_that_are_taken_off_again_do_not_end_the_window() {
        let Some(mut pictures) = pictures() else { return };
        let mut frame = frame(3);
        let bend = |p: &nalgebra::Point3<f64>| [0.1 * p.y, 0.0, 0.02 * p.x];
        frame.object.displacement = frame.object.rest.mesh().vertices().iter().map(bend).collect();
        let camera = ViewCamera::default();
        let mut seen = |shading| {
            let display = Display { shading, ..Display::default() };
            pictures.draw(&frame, &display, &camera)
        };
        let plain = seen(Shading::Plain);
        for shading in Shading::ALL {
            let coloured = seen(shading);
            assert_eq!(coloured == plain, shading == Shading::Plain, "{shading}");
            assert!(seen(Shading::Plain) == plain, "{shading} leaves something behind");
        }
    }

    /// Share of the pixels of two pictures that differ as far as everybody sees.
    fn share_that_differs(a: &RgbImage, b: &RgbImage) -> f64 {
        let differs = |(a, b): &(&image::Rgb<u8>, &image::Rgb<u8>)| {
            a.0.iter().zip(b.0).any(|(a, b)| a.abs_diff(b) > 24)
        };
        a.pixels().zip(b.pixels()).filter(differs).count() as f64 / a.pixels().len() as f64
    }

    #[test]
    fn ghost_of_the_shape_at_rest_is_seen_where_the_shape_is_not() {
        let Some(mut pictures) = pictures() else { return };
        let mut frame = frame(3);
        // Pressed flat to two thirds: the ghost stands out above it.
        let press = |p: &nalgebra::Point3<f64>| [0.0, -p.y / 3.0, 0.0];
        frame.object.displacement = frame.object.rest.mesh().vertices().iter().map(press).collect();
        let mut camera = ViewCamera::default();
        camera.frame(frame.object.rest.centre(), 0.7 * frame.object.rest.mesh().size());
        for level in Level::ALL {
            let mut seen = |ghost| {
                let display = Display { ghost, level, ..Display::default() };
                pictures.draw(&frame, &display, &camera)
            };
            let share = share_that_differs(&seen(false), &seen(true));
            assert!(share > 0.03, "{level}: the ghost changes {share} of the picture");
        }
    }

    #[test]
    fn object_that_lies_beside_the_first_is_seen_and_has_its_own_look() {
        let Some(mut pictures) = pictures() else { return };
        let (alone, mut two) = (frame(3), frame(3));
        let own = |look| OwnLook {
            name: "another".into(),
            look,
            material: Material::try_new(2.0e4, 0.4).unwrap(),
        };
        let beside = |look| ObjectView {
            number: 1,
            own: Some(own(look)),
            world_from_object: nalgebra::Isometry3::translation(0.05, 0.0, 0.0),
            ..alone.object.clone()
        };
        let mut camera = ViewCamera::default();
        camera.frame(alone.object.rest.centre(), alone.object.rest.mesh().size());
        let display = Display::default();
        let before = pictures.draw(&alone, &display, &camera);
        two.others = vec![beside(Look::Sphere)];
        let ball = pictures.draw(&two, &display, &camera);
        let share = share_that_differs(&before, &ball);
        assert!(share > 0.03, "the other object changes {share} of the picture");
        let Some(mut others) = self::pictures() else { return };
        two.others = vec![beside(Look::Imported)];
        let clay = others.draw(&two, &display, &camera);
        let share = share_that_differs(&ball, &clay);
        assert!(share > 0.01, "its look changes {share} of the picture");
    }
}
