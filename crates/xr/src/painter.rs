//! Thread beside the ticks that makes pictures for the pages from the frames that the ticks offer.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender};
use std::time::{Duration, Instant};

use softgrasp_core::fem::Material;
use softgrasp_grasp::grasp::StateName;
use softgrasp_hand::notice::{Notice, NoticeKind};
use softgrasp_window::view::camera::ViewCamera;
use softgrasp_window::view::colouring::Colouring;
use softgrasp_window::view::control::Control;
use softgrasp_window::view::directed_eye::DirectedEye;
use softgrasp_window::view::frame::{HandView, NewsKind, ViewFrame};
use softgrasp_window::view::ground_shade::capsules;
use softgrasp_window::view::light::GROUND_M;
use softgrasp_window::view::loading::LoadObject;
use softgrasp_window::view::object_skin::Look;
use softgrasp_window::view::outlet::Inlet;
use softgrasp_window::view::shading::Shading;
use tokio::sync::watch;

use crate::from_page::Ask;
use crate::picture::{Picture, PosedHand};
use crate::quantised::{QuantisedBox, folded};
use crate::shown_hand::ShownHand;
use crate::shown_object::ShownObjects;
use crate::status::{Sentences, status_text};
use crate::textures::Textures;
use crate::wishes::{Granted, Wishes};

/// Run that pages show, and the channels between both.
pub struct ShownRun {
    /// Look of the object: its skin.
    pub look: Look,
    /// Material of the object, from which stresses for the colours are computed.
    pub material: Material,
    /// Quantity that the colours show; `None` shows strain while a script squeezes.
    pub shading: Option<Shading>,
    /// Whether a script moves the hand, so that colours are left to the page.
    pub is_directed: bool,
    /// Whether a script begins anew after its end and a pause.
    pub begins_anew: bool,
    /// Whether a window shows the run too, and itself asks for the fields it needs.
    pub has_window: bool,
    /// Channel for wishes to the ticks.
    pub controls: Sender<Control>,
    /// Channel of sentences for the person.
    pub notices: Receiver<Notice>,
    /// Reads other objects; `None` where the page may not.
    pub load: Option<LoadObject>,
}

/// State that the painter shares with the pages.
pub struct Easel {
    /// Newest picture.
    pub pictures: watch::Sender<Option<Arc<Picture>>>,
    /// Wishes of the pages.
    pub asked: Receiver<Ask>,
    /// Number of open pages.
    pub viewers: Arc<AtomicUsize>,
    /// Textures of object and hand.
    pub textures: Textures,
    /// Whether the painter is to end.
    pub stop: Arc<AtomicBool>,
}

/// Time between two looks at the ticks' outlet.
const LOOK_EVERY: Duration = Duration::from_millis(3);
/// Shortest time between two changes of the status text.
const STATUS_EVERY: Duration = Duration::from_millis(100);
/// Time after the end of a script until it begins anew.
const PAUSE: Duration = Duration::from_secs(9);
/// Share of the picture's height by which the scene is moved down, because the menu is above it.
const UNDER_MENU: f64 = 0.07;
/// Number of nodes above which strain is not shown unasked: it needs all nodes of every answer.
const COLOURED_NODES_MAX: usize = 20_000;

/// Makes pictures until it is told to stop.
pub struct Painter {
    run: ShownRun,
    easel: Easel,
    inlet: Inlet,
    wishes: Wishes,
    colouring: Colouring,
    sentences: Sentences,
    eye: DirectedEye,
    camera: Option<ViewCamera>,
    objects: Option<ShownObjects>,
    hands: [Option<ShownHand>; 2],
    hand_texture: Option<u32>,
    version: u32,
    space: Option<QuantisedBox>,
    status: Arc<str>,
    told: Option<Instant>,
    asked_whole: bool,
    over_since: Option<Instant>,
    newest: Option<Box<ViewFrame>>,
    places: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
}

impl Painter {
    /// Painter of the frames that come through an inlet.
    pub fn new(run: ShownRun, easel: Easel, inlet: Inlet) -> Self {
        let wishes = Wishes::new(run.controls.clone(), run.load.clone());
        Self {
            colouring: Colouring::new(run.material),
            run,
            easel,
            inlet,
            wishes,
            sentences: Sentences::default(),
            eye: DirectedEye::new(false).lowered(UNDER_MENU),
            camera: None,
            objects: None,
            hands: [None, None],
            hand_texture: None,
            version: 0,
            space: None,
            status: "".into(),
            told: None,
            asked_whole: false,
            over_since: None,
            newest: None,
            places: Vec::new(),
            normals: Vec::new(),
        }
    }

    /// Works until it is told to stop.
    pub fn work(mut self) {
        let mut had_viewers = false;
        while !self.easel.stop.load(Ordering::Relaxed) {
            self.hear();
            let has_viewers = self.easel.viewers.load(Ordering::Relaxed) > 0;
            let arrived = self.inlet.take();
            let is_new = arrived.is_some();
            if let Some(frame) = arrived {
                self.take_news(&frame);
                self.newest = Some(frame);
            }
            // Somebody who comes while the run stands still sees where it stands.
            if has_viewers
                && (is_new || !had_viewers)
                && let Some(frame) = self.newest.take()
            {
                if let Some(picture) = self.paint(&frame) {
                    self.easel.pictures.send_replace(Some(Arc::new(picture)));
                }
                self.newest = Some(frame);
            }
            had_viewers = has_viewers;
            if !is_new {
                std::thread::sleep(LOOK_EVERY);
            }
        }
    }

    /// Carries out wishes of the pages, and takes the news of the ticks.
    fn hear(&mut self) {
        while let Ok(Notice { text, kind }) = self.run.notices.try_recv() {
            self.sentences.say(text, kind == NoticeKind::Refused);
        }
        while let Ok(ask) = self.easel.asked.try_recv() {
            let granted = self.wishes.grant(ask);
            self.granted(granted);
        }
        let granted = self.wishes.look_after_reading();
        self.granted(granted);
    }

    fn granted(&mut self, granted: Granted) {
        match granted {
            Granted::Nothing => {}
            Granted::Said(text, refused) => self.sentences.say(text, refused),
            Granted::Shading(shading) => self.run.shading = Some(shading),
            Granted::Look(look) => self.run.look = look,
        }
    }

    fn take_news(&mut self, frame: &ViewFrame) {
        for news in frame.news.iter().filter(|news| news.kind == NewsKind::Refusal) {
            self.sentences.say(news.text.clone(), true);
        }
        if !frame.acts.story_is_over {
            self.over_since = None;
        } else if self.run.begins_anew {
            let since = *self.over_since.get_or_insert_with(Instant::now);
            if since.elapsed() >= PAUSE {
                self.over_since = None;
                self.wishes.control(Control::Restart);
            }
        }
    }

    /// Quantity that the colours show now; asks for the nodes that it needs.
    fn shading(&mut self, frame: &ViewFrame) -> Shading {
        let may_direct = self.run.is_directed
            && self.run.shading.is_none()
            && frame.object.rest.mesh().node_count() <= COLOURED_NODES_MAX;
        let is_squeezed = frame.grasp.state == Some(StateName::Deforming);
        let shading = match (self.run.shading, may_direct && is_squeezed) {
            (Some(shading), _) => shading,
            (None, true) => Shading::Strain,
            (None, false) => Shading::Plain,
        };
        let whole = shading.needs_inside() || may_direct;
        // A window asks for itself; what it does not need, nobody takes away from it.
        if whole != self.asked_whole && (whole || !self.run.has_window) {
            self.wishes.control(Control::SetWhole(whole));
            self.asked_whole = whole;
        }
        shading
    }

    /// The picture of a frame; `None` for a shape that cannot be shown.
    fn paint(&mut self, frame: &ViewFrame) -> Option<Picture> {
        let shading = self.shading(frame);
        self.colouring.follow(&frame.object, shading, frame.at_s);
        self.dress(frame);
        let objects = self.objects.as_mut()?;
        objects.follow(frame, &mut self.places, &mut self.normals);
        let (space, numbers) = counted(self.space, &self.places)?;
        self.space = Some(space);
        let shares = objects.shares(self.colouring.shares(), numbers.len());
        let mesh = Arc::clone(&objects.mesh);
        let pose = objects.world_from_vertices(frame);
        let hands = self.pose_hands(frame);
        let (t, q) = (&pose.translation, &pose.rotation);
        Some(Picture {
            tick: frame.tick,
            object: mesh,
            hands,
            record: frame.hands().filter_map(|hand| u32::try_from(hand.record?).ok()).max(),
            world_from_object: [t.x, t.y, t.z, q.i, q.j, q.k, q.w].map(|x| x as f32),
            ground_y: frame.object.table_y.unwrap_or(GROUND_M) as f32,
            capsules: capsules(frame, &frame.shape(), true).iter().map(|c| c.scaled(1.0)).collect(),
            space,
            numbers,
            normals: self.normals.iter().map(|normal| folded(*normal)).collect(),
            shares,
            status: self.status(frame),
        })
    }

    fn dress(&mut self, frame: &ViewFrame) {
        let touched = frame.object.number;
        if let Some(shown) = self.objects.as_mut()
            && shown.are(frame)
        {
            if !shown.begin_with(touched) {
                self.version += 1;
                shown.put_first(self.version, touched);
            }
            return;
        }
        // Another object that did not come through a page has no name here.
        let is_ours = self.objects.is_none() || !self.run.has_window;
        let look = if is_ours { self.run.look } else { Look::Imported };
        self.version += 1;
        self.objects = Some(ShownObjects::new(self.version, look, frame, &self.easel.textures));
        self.space = None;
    }

    fn pose_hands(&mut self, frame: &ViewFrame) -> [Option<PosedHand>; 2] {
        let Self { hands, hand_texture, version, easel, .. } = self;
        let mut pose = |shown: &mut Option<ShownHand>, hand: &HandView| {
            if shown.as_ref().is_none_or(|shown| !shown.fits(hand)) {
                let texture =
                    *hand_texture.get_or_insert_with(|| ShownHand::texture(&easel.textures));
                *version += 1;
                *shown = Some(ShownHand::new(*version, hand, texture));
            }
            let shown = shown.as_ref()?;
            Some((Arc::clone(&shown.mesh), shown.bones(hand)))
        };
        let [first, second] = hands;
        [
            frame.hand.as_ref().and_then(|hand| pose(first, hand)),
            frame.second_hand.as_ref().and_then(|hand| pose(second, hand)),
        ]
    }

    fn status(&mut self, frame: &ViewFrame) -> Arc<str> {
        if self.told.is_some_and(|then| then.elapsed() < STATUS_EVERY) {
            return Arc::clone(&self.status);
        }
        self.told = Some(Instant::now());
        let now = self.camera.unwrap_or_default();
        let directed = self.eye.eye(frame, now, frame.at_s);
        self.camera = directed.or(self.camera).or_else(|| frame.eye_beside_hand());
        self.status = status_text(frame, &self.colouring, self.camera, &self.sentences).into();
        Arc::clone(&self.status)
    }
}

/// Vertices in counts of a box: the present one, or a new one if a vertex has left it.
fn counted(
    space: Option<QuantisedBox>,
    places: &[[f32; 3]],
) -> Option<(QuantisedBox, Vec<[u16; 3]>)> {
    let count = |space: &QuantisedBox| places.iter().map(|place| space.numbers(*place)).collect();
    if let Some((space, numbers)) = space.and_then(|space| Some((space, count(&space)?))) {
        return Some((space, numbers));
    }
    let space = QuantisedBox::around(places)?;
    let numbers: Option<Vec<[u16; 3]>> = count(&space);
    Some((space, numbers?))
}
