//! The cards of the window do not lie over each other, in windows of all sizes and in all states.

use std::sync::mpsc::channel;
use std::time::Duration;

use egui::epaint::ClippedShape;
use egui::{
    Color32, Context, Event, FontDefinitions, FontFamily, Id, Modifiers, PointerButton, Pos2,
    RawInput, Rect, Shape, Vec2,
};
use nalgebra::Vector3;
use softgrasp_core::fem::Material;
use softgrasp_grasp::grasp::StateName;
use softgrasp_hand::hand_request::HandChoice;
use softgrasp_hand::scripted::ScriptName;
use softgrasp_hand::sent::{Device, SilentDevice};

use super::changes::Change;
use super::panels::{Panels, Seen};
use super::running::{About, Running, Ticks};
use super::ui::places;
use super::ui::softness_card::SoftnessWish;
use crate::view::colouring::Colouring;
use crate::view::display::Display;
use crate::view::frame::ViewFrame;
use crate::view::frame::samples::frame;
use crate::view::outlet::outlet;
use crate::view::shading::Shading;
use crate::view::toggle::Page;

/// Cards that are there at the same time.
const CARDS: [&str; 6] = ["bar", "status", "time line", "left", "right", "top"];
const SIZES: [[f32; 2]; 4] = [[800.0, 600.0], [1000.0, 700.0], [1280.0, 800.0], [1920.0, 1080.0]];

/// A run in the worst of states: everything is late, silent and squeezed.
pub(super) fn running(hand: HandChoice) -> Running {
    running_with(hand, |_| {})
}

/// A running window's state whose newest picture is changed.
pub(super) fn running_with(hand: HandChoice, change: impl FnOnce(&mut ViewFrame)) -> Running {
    let (controls, _obeyed) = channel();
    let (_told, notices) = channel();
    let ticks = Ticks { controls, notices, is_over: Box::new(|| false), when_lost: None };
    let (mut out, inlet) = outlet(Duration::ZERO);
    let mut frame = frame(12_345);
    frame.grasp.state = Some(StateName::Deforming);
    frame.grasp.forces = Some([Vector3::new(1.0, 2.0, 3.0); 5]);
    let silent = |device| SilentDevice { device, side: None };
    frame.grasp.silent = [Device::Glove, Device::Tracker].map(silent).to_vec();
    frame.server.shown_tick = Some(1);
    frame.server.said = Some("lost: the connection broke: reset by peer (os error 104)".to_owned());
    change(&mut frame);
    out.publish(Box::new(frame));
    let about = About {
        object: "strawberry".to_owned(),
        server: "in this program".to_owned(),
        contact: "a fingertip holds what lies under it, weighted by its pressure (mask)".to_owned(),
        is_lifted: false,
        material: Material::try_new(2.0e4, 0.4).unwrap(),
        hand,
        method: "auto".to_owned(),
        max_error: None,
        tick_s: 1.0 / 60.0,
        begins_anew: true,
        server_stage: Box::new(|| "factoring"),
    };
    let mut running = Running::new(ticks, inlet, about);
    running.look();
    running
}

/// A run as the window sees it that draws it.
pub(super) fn seen<'a>(
    running: &'a Running,
    display: &'a Display,
    colouring: &'a Colouring,
) -> Seen<'a> {
    Seen {
        running: Some(running),
        display,
        colouring,
        change: &Change::None,
        starting: None,
        graphics: ("a graphics card with a long name (Vulkan)", 15.0),
        is_recording: false,
        newtons_per_m: 20.0,
        story_begins_in: None,
    }
}

/// Where the cards are in the fifth picture: the first ones measure them.
fn cards(
    size: [f32; 2],
    running: &Running,
    shading: Shading,
    pages: &[Page],
) -> Vec<(&'static str, Rect)> {
    let (context, mut panels) = (Context::default(), Panels::default());
    pages.iter().for_each(|page| panels.toggle(*page));
    panels.notices.add("a sentence that says at some length what cannot be done and why", true);
    panels.notices.add("shape kept", false);
    let display = Display { shading, ..Display::default() };
    let colouring = Colouring::new(running.about.material);
    let begins_in = running.about.hand.is_played().then_some(Duration::from_secs(5));
    let seen = Seen { story_begins_in: begins_in, ..seen(running, &display, &colouring) };
    let screen = Rect::from_min_size(Pos2::ZERO, Vec2::from(size));
    for _ in 0..5 {
        let input = RawInput { screen_rect: Some(screen), ..RawInput::default() };
        let output = context.run_ui(input, |ui| {
            panels.show(ui.ctx(), &seen);
        });
        output.drop_without_applying_deltas();
    }
    let place = |name: &'static str| {
        let rect = context.memory(|memory| memory.area_rect(Id::new(name)))?;
        Some((name, rect))
    };
    CARDS.into_iter().filter_map(place).collect()
}

#[test]
fn panels_do_not_overlap_in_windows_of_any_size() {
    let hands = [HandChoice::Scripted(ScriptName::Regrasp), HandChoice::Mouse, HandChoice::Live];
    let every = [Page::Information, Page::Timings, Page::Softness];
    for hand in hands {
        let running = running(hand);
        for size in SIZES {
            for pages in [&[][..], &every[..1], &every[1..2], &every[2..], &every[..]] {
                for shading in [Shading::Plain, Shading::Strain] {
                    let all = cards(size, &running, shading, pages);
                    assert!(all.len() >= 3, "{all:?}");
                    let top = all.iter().find(|(name, _)| *name == "top");
                    let tells = top.map_or(0.0, |(_, rect)| rect.height());
                    assert!(tells > 90.0, "what is told is cut off: {tells} points are seen");
                    let screen = Rect::from_min_size(Pos2::ZERO, Vec2::from(size));
                    for (place, (name, rect)) in all.iter().enumerate() {
                        assert!(
                            screen.expand(0.5).contains_rect(*rect),
                            "{name} {rect:?} of {size:?}"
                        );
                        for (other, of_other) in &all[..place] {
                            let shared = rect.intersect(*of_other);
                            assert!(
                                shared.width() <= 0.5 || shared.height() <= 0.5,
                                "{name} {rect:?} lies over {other} {of_other:?} in {size:?}, \
                                 {hand:?}, {pages:?}, {shading}"
                            );
                        }
                    }
                }
            }
        }
    }
}

/// A picture with these panels, and the place of a card in it.
fn picture(context: &Context, panels: &mut Panels, running: &Running) -> Vec<ClippedShape> {
    let (display, colouring) = (Display::default(), Colouring::new(running.about.material));
    let seen = seen(running, &display, &colouring);
    let screen = Rect::from_min_size(Pos2::ZERO, Vec2::new(800.0, 600.0));
    let input = RawInput { screen_rect: Some(screen), ..RawInput::default() };
    let mut output = context.run_ui(input, |ui| {
        panels.show(ui.ctx(), &seen);
    });
    let shapes = std::mem::take(&mut output.shapes);
    output.drop_without_applying_deltas();
    shapes
}

#[test]
fn status_that_grows_in_a_squeeze_does_not_lie_over_the_time_line_for_a_picture() {
    let hand = HandChoice::Scripted(ScriptName::Lift);
    let calm = running_with(hand, |frame| {
        frame.grasp.state = Some(StateName::Free);
        (frame.grasp.forces, frame.grasp.silent) = (None, Vec::new());
    });
    let (squeezed, context, mut panels) = (running(hand), Context::default(), Panels::default());
    let rect = |name: &str| context.memory(|memory| memory.area_rect(Id::new(name))).unwrap();
    (0..5).for_each(|_| drop(picture(&context, &mut panels, &calm)));
    let low = rect("status");
    picture(&context, &mut panels, &squeezed);
    let high = rect("status");
    assert!(high.height() > low.height() + 30.0, "{low:?} {high:?}");
    for status in [low, high] {
        let time_line = rect("time line");
        assert!(status.bottom() <= time_line.top(), "{status:?} lies over {time_line:?}");
    }
}

#[test]
fn time_line_does_not_tremble_while_the_ticks_are_counted() {
    let (context, mut panels) = (Context::default(), Panels::default());
    // As in the window, whose digits are not of one width.
    let mut fonts = FontDefinitions::default();
    let letters = fonts.families[&FontFamily::Proportional].clone();
    fonts.families.insert(FontFamily::Monospace, letters);
    context.set_fonts(fonts);
    let places = [7, 88, 111, 12_345].map(|tick| {
        let hand = HandChoice::Scripted(ScriptName::Lift);
        let running = running_with(hand, |frame| frame.tick = tick);
        (0..4).for_each(|_| drop(picture(&context, &mut panels, &running)));
        ["Play or pause", "time line"].map(|name| places::of(&context, name).unwrap())
    });
    assert!(places.iter().all(|place| *place == places[0]), "{places:?}");
}

#[test]
fn menu_that_was_opened_is_not_looked_through() {
    let (context, mut panels) = (Context::default(), Panels::default());
    let running = running(HandChoice::Mouse);
    (0..3).for_each(|_| drop(picture(&context, &mut panels, &running)));
    panels.open_menu(&context, [300.0, 200.0].into());
    // The first picture only measures it.
    picture(&context, &mut panels, &running);
    let shapes = picture(&context, &mut panels, &running);
    let menu = context.memory(|memory| memory.area_rect(Id::new("pop-up menu"))).unwrap();
    let grounds: Vec<_> = shapes.iter().flat_map(|clipped| rectangles(&clipped.shape)).collect();
    let ground = grounds.iter().find(|(rect, _)| (rect.size() - menu.size()).length() < 2.0);
    let (_, fill) = ground.unwrap_or_else(|| panic!("no ground of {menu:?}: {grounds:?}"));
    assert!(fill.is_opaque(), "{fill:?}");
}

/// Rectangles of a shape that are filled, and with what.
fn rectangles(shape: &Shape) -> Vec<(Rect, Color32)> {
    match shape {
        Shape::Rect(rect) if rect.fill != Color32::TRANSPARENT && rect.blur_width == 0.0 => {
            vec![(rect.rect, rect.fill)]
        }
        Shape::Vec(shapes) => shapes.iter().flat_map(rectangles).collect(),
        _ => Vec::new(),
    }
}

/// A window with the sliders of softness open, and what was wished for in it.
struct Softened {
    context: Context,
    panels: Panels,
    running: Running,
    display: Display,
    wishes: Vec<SoftnessWish>,
}

impl Softened {
    fn new() -> Self {
        let running = running(HandChoice::Mouse);
        let (context, mut panels) = (Context::default(), Panels::default());
        panels.toggle(Page::Softness);
        let display = Display { shading: Shading::Plain, ..Display::default() };
        let mut softened = Self { context, panels, running, display, wishes: Vec::new() };
        (0..3).for_each(|_| softened.picture(Vec::new()));
        softened
    }

    fn picture(&mut self, events: Vec<Event>) {
        let colouring = Colouring::new(self.running.about.material);
        let seen = seen(&self.running, &self.display, &colouring);
        let screen = Rect::from_min_size(Pos2::ZERO, Vec2::new(1280.0, 800.0));
        let input = RawInput { screen_rect: Some(screen), events, ..RawInput::default() };
        let mut wish = None;
        let output = self.context.run_ui(input, |ui| {
            wish = wish.or(self.panels.show(ui.ctx(), &seen).softness);
        });
        output.drop_without_applying_deltas();
        self.wishes.extend(wish);
    }

    fn slider(&self, name: &str) -> [i32; 4] {
        places::of(&self.context, name).unwrap_or_else(|| panic!("no slider '{name}'"))
    }

    /// Takes a slider in its middle, draws it along in steps, and lets go.
    fn draw(&mut self, name: &str, along: f32) {
        let [x, y, ..] = self.slider(name).map(|v| v as f32);
        let button = |pos, pressed| {
            let (button, modifiers) = (PointerButton::Primary, Modifiers::NONE);
            Event::PointerButton { pos, button, pressed, modifiers }
        };
        // The slider lies at the left of its number.
        let from = Pos2::new(x - 0.2 * self.slider(name)[2] as f32, y);
        self.picture(vec![Event::PointerMoved(from)]);
        self.picture(vec![button(from, true)]);
        for step in 1..=5 {
            let to = from + Vec2::new(along * step as f32 / 5.0, 0.0);
            self.picture(vec![Event::PointerMoved(to)]);
        }
        assert_eq!(self.wishes, [], "nothing is asked for while it is drawn");
        let to = from + Vec2::new(along, 0.0);
        self.picture(vec![button(to, false)]);
        self.picture(Vec::new());
    }
}

#[test]
fn sliders_of_softness_stay_in_place_when_the_legend_of_strain_comes() {
    let mut window = Softened::new();
    let names = ["stiffness", "Poisson's ratio", "size", "nodes"];
    let before = names.map(|name| window.slider(name));
    window.display.shading = Shading::Strain;
    (0..3).for_each(|_| window.picture(Vec::new()));
    assert_eq!(names.map(|name| window.slider(name)), before);
}

#[test]
fn slider_of_stiffness_that_is_drawn_wishes_for_one_other_material_once_it_is_let_go() {
    for (along, is_stiffer) in [(30.0, true), (-30.0, false)] {
        let mut window = Softened::new();
        window.draw("stiffness", along);
        let [SoftnessWish::Material { young, poisson }] = window.wishes[..] else {
            panic!("{:?}", window.wishes)
        };
        assert_eq!((young > 2.0e4, poisson), (is_stiffer, 0.4), "{young}");
    }
}
