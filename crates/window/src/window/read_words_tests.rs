//! What a person reads on the cards, the menus and the dialogs.

use std::time::{Duration, Instant};

use egui::epaint::ClippedShape;
use egui::{Context, Pos2, RawInput, Rect, Shape, Ui, Vec2};
use softgrasp_grasp::grasp::StateName;
use softgrasp_hand::hand_request::HandChoice;
use softgrasp_hand::scripted::ScriptName;

use super::panels::Panels;
use super::panels_tests::{running, running_with, seen};
use super::running::Running;
use super::ui::menu::{self, MenuFacts};
use crate::view::colouring::Colouring;
use crate::view::display::Display;
use crate::view::shading::Shading;
use crate::view::toggle::Page;

/// The words of the shapes of a picture.
fn words_of(shapes: &[ClippedShape]) -> String {
    fn add(shape: &Shape, words: &mut String) {
        match shape {
            Shape::Text(text) => {
                words.push_str(text.galley.text());
                words.push('\n');
            }
            Shape::Vec(shapes) => shapes.iter().for_each(|shape| add(shape, words)),
            _ => {}
        }
    }
    let mut words = String::new();
    shapes.iter().for_each(|clipped| add(&clipped.shape, &mut words));
    words
}

/// What is read in the fifth picture of something: the first ones measure it.
pub(super) fn words_read(mut show: impl FnMut(&mut Ui)) -> String {
    let context = Context::default();
    let screen = Rect::from_min_size(Pos2::ZERO, Vec2::new(1280.0, 900.0));
    let mut words = String::new();
    for _ in 0..5 {
        let input = RawInput { screen_rect: Some(screen), ..RawInput::default() };
        let mut output = context.run_ui(input, &mut show);
        words = words_of(&std::mem::take(&mut output.shapes));
        output.drop_without_applying_deltas();
    }
    words
}

/// What is read over the scene of a run with these pages open.
fn read_panels(running: &Running, panels: &mut Panels, pages: &[Page], shading: Shading) -> String {
    pages.iter().for_each(|page| panels.toggle(*page));
    let display = Display { shading, ..Display::default() };
    let colouring = Colouring::new(running.about.material);
    let seen = seen(running, &display, &colouring);
    words_read(|ui| {
        panels.show(ui.ctx(), &seen);
    })
}

const STATES: [Option<StateName>; 6] = [
    None,
    Some(StateName::Free),
    Some(StateName::Avoiding),
    Some(StateName::Attached),
    Some(StateName::Deforming),
    Some(StateName::Detached),
];
const HANDS: [HandChoice; 4] = [
    HandChoice::Scripted(ScriptName::Lift),
    HandChoice::Mouse,
    HandChoice::Live,
    HandChoice::Replay,
];
/// What only somebody who wrote the program understands.
const AWKWARD: [&str; 9] = [
    "not proven",
    "dropped sample",
    "avoiding",
    "deforming",
    "os error",
    "held by mask",
    "solved by embedded",
    "mask",
    "residual",
];

#[test]
fn awkward_words_are_read_nowhere_but_on_the_page_of_f2() {
    for hand in HANDS {
        for state in STATES {
            let running = running_with(hand, |frame| frame.grasp.state = state);
            let pages = [Page::Help, Page::Timings, Page::Softness];
            let read = read_panels(&running, &mut Panels::default(), &pages, Shading::Strain);
            assert!(read.len() > 200, "{read}");
            for awkward in AWKWARD {
                assert!(!read.to_lowercase().contains(awkward), "{hand:?}: '{awkward}' in\n{read}");
            }
        }
        let all = read_panels(
            &running(hand),
            &mut Panels::default(),
            &[Page::Information],
            Shading::Plain,
        );
        assert!(all.contains("os error 104") && all.contains("mask"), "F2 tells all: {all}");
    }
}

#[test]
fn large_object_is_said_to_be_prepared_with_what_the_server_is_at_and_that_the_hand_waits() {
    let hand = HandChoice::Scripted(ScriptName::Lift);
    let is_preparing = |prepares| running_with(hand, |frame| frame.server.is_preparing = prepares);
    let mut panels = Panels::default();
    let long_ago = Instant::now().checked_sub(Duration::from_secs(75)).unwrap();
    panels.prepares_since = Some(long_ago);
    let read = read_panels(&is_preparing(true), &mut panels, &[], Shading::Plain);
    for words in ["Preparing the strawberry (27 nodes): 7", "The server is factoring.", "waits"] {
        assert!(read.contains(words), "'{words}' is not in\n{read}");
    }
    let read = read_panels(&is_preparing(false), &mut panels, &[], Shading::Plain);
    assert!(!read.contains("Preparing"), "{read}");
}

#[test]
fn device_that_is_silent_before_there_was_a_hand_is_not_said_to_leave_the_hand_where_it_was() {
    let silent = running_with(HandChoice::Live, |frame| frame.hand = None);
    let read = read_panels(&silent, &mut Panels::default(), &[], Shading::Plain);
    assert!(read.contains("The glove is silent: there is no hand yet."), "{read}");
    assert!(!read.contains("stays where it was"), "{read}");
}

fn facts<'a>(display: &'a Display, method: &'a str, solved_by: Option<&'a str>) -> MenuFacts<'a> {
    MenuFacts {
        display,
        hand: HandChoice::Mouse,
        object: "cube",
        method,
        solved_by,
        max_error: None,
        can_undo: false,
        is_recording: false,
        can_keep: false,
    }
}

#[test]
fn running_method_is_in_its_own_menu() {
    let display = Display::default();
    // One that was named on the command line and is none of the usual ones.
    for (asked, answered) in [("inverse", "inverse"), ("auto", "front")] {
        let facts = facts(&display, asked, Some(answered));
        let read = words_read(|ui| drop(menu::methods(ui, &facts)));
        assert!(read.lines().any(|line| line == asked), "{asked}: {read}");
        assert!(read.contains(&format!("the last answer: {answered}")), "{read}");
        assert!(!read.contains("999"), "{read}");
    }
}
