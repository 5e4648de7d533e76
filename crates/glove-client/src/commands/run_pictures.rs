//! Pictures of a run without a window: one moment, every tick, or an animation.

use std::path::{Path, PathBuf};

use anyhow::Context;
use softgrasp_grasp::grasp::StateName;
use softgrasp_hand::sent::TICKS_PER_S;
use softgrasp_window::view::camera::ViewCamera;
use softgrasp_window::view::directed_eye::DirectedEye;
use softgrasp_window::view::display::{Display, Level};
use softgrasp_window::view::frame::ViewFrame;
use softgrasp_window::view::moment::{Moment, Watch};
use softgrasp_window::view::object_skin::Look;
use softgrasp_window::view::shading::Shading;
use softgrasp_window::window::{Animation, Pictures, RgbImage, png};

use super::display_arguments::DisplayArguments;
use super::run_arguments::RunArguments;
use super::run_plan::RunPlan;
use crate::object::file_writing::write_file;
use crate::pace::Due;
use crate::run::observer::{Foresight, Observer};
use crate::run::session::Session;
use crate::run::tick_outcome::TickOutcome;

/// Draws the wanted pictures, tick by tick.
pub(super) struct RunPictures {
    pictures: Pictures,
    display: Display,
    /// View; `None` until the first hand sets it.
    camera: Option<ViewCamera>,
    eye: DirectedEye,
    foresight: Foresight,
    /// Whether an animation shows strain while the hand squeezes.
    directs_colours: bool,
    observer: Observer,
    snapshot: Option<Snapshot>,
    frames_dir: Option<PathBuf>,
    animation: Option<(PathBuf, Animation)>,
}

/// Picture of one moment.
struct Snapshot {
    path: PathBuf,
    watch: Watch,
    /// Frame of the last tick so far that the snapshot could show; a later one may replace it.
    kept: Option<Box<ViewFrame>>,
    /// Number of paths of light for each pixel, if light is traced.
    paths: Option<u32>,
    /// Moment that was asked for, for the sentence that tells that it did not occur.
    moment: Option<Moment>,
}

/// Ticks between two pictures of an animation: 15 pictures a second at 60 ticks a second.
const ANIMATED_TICKS: u64 = 4;

impl RunPictures {
    /// Begins to draw, if pictures were asked for.
    ///
    /// # Errors
    /// Sentence if nothing can draw or the folder cannot be made.
    pub(super) fn start(arguments: &RunArguments, plan: &RunPlan) -> anyhow::Result<Option<Self>> {
        let shown = &arguments.shown;
        if !shown.wants_pictures() {
            return Ok(None);
        }
        let size = shown.size();
        let look = Look::of(&plan.first.object.to_string());
        let material = plan.elastic_material()?;
        let pictures = Pictures::try_new(size.width, size.height, look, material)
            .context("no pictures can be drawn")?;
        if let Some(folder) = &shown.frames_dir {
            std::fs::create_dir_all(folder)
                .with_context(|| format!("cannot make the folder {}", folder.display()))?;
        }
        let snapshot = shown.snapshot.as_ref().map(|path| Snapshot {
            path: path.clone(),
            watch: Watch::new(shown.at.unwrap_or(Moment::Tick(u64::MAX))),
            kept: None,
            paths: shown.paths,
            moment: shown.at,
        });
        Ok(Some(Self {
            display: Display { level: level(shown, &pictures), ..shown.display() },
            pictures,
            camera: shown.eye.map(|_| shown.camera()),
            eye: DirectedEye::new(shown.eye.is_some()),
            foresight: Foresight::default(),
            directs_colours: shown.shading.is_none(),
            observer: Observer::default(),
            snapshot,
            frames_dir: shown.frames_dir.clone(),
            animation: shown.animation.as_ref().map(|path| (path.clone(), Animation::default())),
        }))
    }

    /// Draws a tick, if its picture is wanted.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(super) fn add(
        &mut self,
        due: Due,
        now_s: f64,
        outcome: &TickOutcome,
        session: &Session,
    ) -> anyhow::Result<()> {
        self.observer.note(due, outcome);
        let mut frame = self.observer.frame(due, now_s, outcome, session.grasp_loop());
        frame.acts = self.foresight.acts(session.hand(), session.grasp_loop());
        let camera = self.camera(&frame);
        if self.animation.is_some() && self.directs_colours {
            self.display.shading = match frame.grasp.state {
                Some(StateName::Deforming) => Shading::Strain,
                _ => Shading::Plain,
            };
        }
        let animates = self.animation.is_some() && due.tick.is_multiple_of(ANIMATED_TICKS);
        if self.frames_dir.is_some() || animates {
            let picture = self.pictures.draw(&frame, &self.display, &camera);
            if let Some(folder) = &self.frames_dir {
                write_picture(&folder.join(format!("{:05}.png", due.tick)), &picture)?;
            }
            if let (true, Some((_, animation))) = (animates, &mut self.animation) {
                animation.add(picture);
            }
        }
        let Some(snapshot) = &mut self.snapshot else { return Ok(()) };
        let (keeps, done) = snapshot.watch.see(due.tick, frame.grasp.state);
        if done {
            return self.take_snapshot();
        }
        if keeps {
            snapshot.kept = Some(Box::new(frame));
        }
        Ok(())
    }

    /// Writes the files that remain.
    ///
    /// # Errors
    /// A file that cannot be written, or a moment that did not occur.
    pub(super) fn finish(mut self) -> anyhow::Result<()> {
        self.take_snapshot()?;
        if let Some((path, animation)) = self.animation {
            let period_s = ANIMATED_TICKS as f64 / TICKS_PER_S;
            let bytes = animation.encode(period_s).context("cannot form the animation")?;
            write_file(&path, &bytes)?;
        }
        Ok(())
    }

    /// View of the pictures: the one asked for, the one that sees most of the squeeze, or one beside the
    /// first hand without a plan.
    fn camera(&mut self, frame: &ViewFrame) -> ViewCamera {
        let directed = self.eye.eye(frame, self.camera.unwrap_or_default(), frame.at_s);
        let camera = directed.or(self.camera).or_else(|| frame.eye_beside_hand());
        self.camera = camera;
        camera.unwrap_or_default()
    }

    /// Draws and writes the moment that was kept.
    fn take_snapshot(&mut self) -> anyhow::Result<()> {
        let Some(Snapshot { path, kept, paths, moment, .. }) = self.snapshot.take() else {
            return Ok(());
        };
        let moment = moment.map_or("a tick".to_owned(), |moment| moment.to_string());
        let frame = kept.with_context(|| {
            format!("no picture was taken: the run did not come to {moment} (--at)")
        })?;
        let camera = self.camera(&frame);
        let picture = match paths {
            Some(paths) => self.pictures.trace(&frame, &self.display, &camera, paths),
            None => self.pictures.draw(&frame, &self.display, &camera),
        };
        write_picture(&path, &picture)
    }
}

/// Effort for light: as asked for; else high for single pictures, and low for many on the processor.
fn level(shown: &DisplayArguments, pictures: &Pictures) -> Level {
    let draws_many = shown.frames_dir.is_some() || shown.animation.is_some();
    match shown.light {
        Some(level) => level,
        None if draws_many && pictures.is_software() => Level::Plain,
        None => Level::default(),
    }
}

fn write_picture(path: &Path, picture: &RgbImage) -> anyhow::Result<()> {
    Ok(write_file(path, &png(picture).context("cannot form the picture")?)?)
}
