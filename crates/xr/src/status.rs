//! Status text beside the picture, as JSON: state of grasp and server, legend, view, sentences.

use std::collections::VecDeque;

use serde::Serialize;
use softgrasp_grasp::grasp::StateName;
use softgrasp_window::view::camera::ViewCamera;
use softgrasp_window::view::colouring::Colouring;
use softgrasp_window::view::frame::ViewFrame;
use softgrasp_window::view::light;
use softgrasp_window::view::shading::Shading;

use crate::to_page::FORMAT;

/// First message to a page: colours, shapes and light of the run.
#[derive(Serialize)]
pub struct Hello {
    hello: u32,
    /// Colours of the legend from zero to the largest value: red, green, blue, alpha of each.
    ramp: Vec<u8>,
    light: LightNumbers,
    /// Names of objects that can be read without a file.
    shapes: [&'static str; 4],
    /// Whether the run takes a headset's hand.
    takes_hands: bool,
}

/// Light and ground, as the window shows them.
#[derive(Serialize)]
struct LightNumbers {
    key_direction: [f32; 3],
    key: [f32; 3],
    fill_direction: [f32; 3],
    fill: [f32; 3],
    wall: [f32; 3],
    fog_m: [f32; 2],
    wrap: f32,
    ground: [f32; 3],
    ground_roughness: f32,
    hand: [f32; 2],
}

impl Hello {
    /// First message of a run that takes hands from a headset or does not.
    pub fn new(ramp: Vec<u8>, takes_hands: bool) -> Self {
        let light = LightNumbers {
            key_direction: light::KEY.direction,
            key: light::KEY.thrown(),
            fill_direction: light::FILL.direction,
            fill: light::FILL.thrown(),
            wall: light::wall(),
            fog_m: light::FOG_M,
            wrap: light::WRAP,
            ground: light::GROUND,
            ground_roughness: light::GROUND_ROUGHNESS,
            hand: light::HAND,
        };
        let shapes = ["strawberry", "toothpaste", "cube", "sphere"];
        Self { hello: FORMAT, ramp, light, shapes, takes_hands }
    }

    /// The message as JSON.
    pub fn text(&self) -> String {
        // Plain numbers and words can be written.
        serde_json::to_string(self).unwrap_or_default()
    }
}

/// Sentences for the person, the newest last; each with a number by which a page knows what is new.
#[derive(Default)]
pub struct Sentences {
    last: u64,
    kept: VecDeque<Sentence>,
}

/// Sentence for the person, with its number.
#[derive(Clone, Serialize)]
pub struct Sentence {
    number: u64,
    text: String,
    refused: bool,
}

/// Number of sentences that are kept for pages that open later.
const SENTENCES_MAX: usize = 6;

impl Sentences {
    /// Adds a sentence; `refused` marks a wish that was refused.
    pub fn say(&mut self, text: String, refused: bool) {
        self.last += 1;
        self.kept.push_back(Sentence { number: self.last, text, refused });
        while self.kept.len() > SENTENCES_MAX {
            self.kept.pop_front();
        }
    }
}

/// Content of the status text.
#[derive(Serialize)]
struct Status<'a> {
    tick: u64,
    state: &'static str,
    deforming: bool,
    tips: [bool; 5],
    /// Those of the second hand, where there is one.
    second_tips: Option<[bool; 5]>,
    grip_n: Option<f64>,
    server: &'static str,
    preparing: bool,
    age_ticks: Option<u64>,
    round_trip_ms: Option<f64>,
    nodes: usize,
    can_keep: bool,
    kept: usize,
    height_mm: f64,
    shading: &'static str,
    legend: Option<LegendText>,
    eye: Option<EyeNumbers>,
    sentences: Vec<&'a Sentence>,
}

#[derive(Serialize)]
struct LegendText {
    title: &'static str,
    marks: Vec<String>,
    remark: String,
}

/// View of the page: target and distance in m, angles in rad.
#[derive(Clone, Copy, PartialEq, Serialize)]
struct EyeNumbers {
    target: [f64; 3],
    distance: f64,
    yaw: f64,
    pitch: f64,
}

/// Status text of a frame, as JSON.
pub fn status_text(
    frame: &ViewFrame,
    colouring: &Colouring,
    eye: Option<ViewCamera>,
    sentences: &Sentences,
) -> String {
    let legend = colouring.legend();
    let is_coloured = legend.shading() != Shading::Plain;
    let status = Status {
        tick: frame.tick,
        state: state(frame),
        deforming: frame.grasp.state == Some(StateName::Deforming),
        tips: frame.grasp.tips,
        second_tips: frame.second_hand.is_some().then_some(frame.grasp.second_tips),
        grip_n: frame.grip_newtons(),
        server: frame.server.link.name(),
        preparing: frame.server.is_preparing,
        age_ticks: frame.answer_age_ticks(),
        round_trip_ms: frame.server.solve.as_ref().map(|solve| solve.round_trip_ms),
        nodes: frame.object.rest.mesh().node_count(),
        can_keep: frame.can_keep(),
        kept: frame.object.kept,
        height_mm: 1e3 * frame.object.world_from_object.translation.y,
        shading: legend.shading().as_str(),
        legend: is_coloured.then(|| LegendText {
            title: legend.shading().title(),
            marks: legend.ticks().map(|tick| tick.text).to_vec(),
            remark: colouring.remark().to_owned(),
        }),
        eye: eye.map(|eye| EyeNumbers {
            target: eye.target.coords.into(),
            distance: eye.distance,
            yaw: eye.yaw,
            pitch: eye.pitch,
        }),
        sentences: sentences.kept.iter().collect(),
    };
    serde_json::to_string(&status).unwrap_or_default()
}

/// The state of the grasp in the words of the window.
fn state(frame: &ViewFrame) -> &'static str {
    if frame.grasp.keeping {
        return "keeping the shape";
    }
    match frame.grasp.state {
        None => "waiting for the hand",
        Some(StateName::Free) => "not touched",
        Some(StateName::Avoiding) => "close by",
        Some(StateName::Attached) => "held",
        Some(StateName::Deforming) => "squeezed",
        Some(StateName::Detached) => "let go",
    }
}
