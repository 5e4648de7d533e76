//! How soft, how large and how fine the object is (F4), with the force that the grip takes.

use egui::{Response, Slider, Ui};

use super::{places, theme};

/// State of the card's sliders.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Softness {
    /// Young's modulus on its slider, kPa.
    young_kpa: f64,
    poisson: f64,
    /// Longest extent on its slider, mm.
    size_mm: f64,
    nodes: usize,
    /// The object as the card saw it last: the sliders follow it until the person moves one.
    seen: Option<Is>,
}

/// The object as it is now: material, size, mesh and grip force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Is {
    /// Young's modulus, Pa.
    pub young: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Longest extent of the object, m.
    pub size_m: f64,
    /// Number of nodes of the mesh.
    pub nodes: usize,
    /// Whether a mesh with another number of nodes can be made.
    pub can_be_refined: bool,
    /// Force of the grip, N.
    pub grip_newtons: Option<f64>,
}

/// What the person wants of the object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SoftnessWish {
    /// The object of another material.
    Material {
        /// Young's modulus, Pa.
        young: f64,
        /// Poisson's ratio.
        poisson: f64,
    },
    /// The object anew, in another size or finer.
    Object {
        /// Number of nodes, where it can be chosen.
        nodes: Option<usize>,
        /// Longest extent of the object, m.
        size_m: f64,
    },
}

/// Young's moduli of what one knows, kPa: each name holds up to this one.
const LIKE: [(f64, &str); 6] = [
    (4.0, "like a kitchen sponge"),
    (12.0, "like a ripe tomato"),
    (40.0, "like a soft fruit"),
    (150.0, "like a bath toy"),
    (600.0, "like an eraser"),
    (f64::INFINITY, "like rubber"),
];
/// Ranges of the sliders.
const YOUNG_KPA: (f64, f64) = (1.0, 2000.0);
const POISSON: (f64, f64) = (0.0, 0.49);
const SIZE_MM: (f64, f64) = (40.0, 120.0);
const NODES: (usize, usize) = (200, 10_000);

impl Softness {
    /// Shows the card; returns what the person wants, once a slider is let go.
    pub fn show(&mut self, ui: &mut Ui, is: &Is) -> Option<SoftnessWish> {
        self.follow(is);
        theme::sheet(ui, |ui| {
            ui.set_width(270.0);
            ui.horizontal(|ui| {
                ui.strong("Softness");
                ui.label(theme::quiet(like(self.young_kpa)));
            });
            let mut young = false;
            let slider = Slider::new(&mut self.young_kpa, YOUNG_KPA.0..=YOUNG_KPA.1);
            let slider = slider.logarithmic(true).suffix(" kPa").max_decimals(1);
            young |= line(ui, "stiffness", slider);
            let slider = Slider::new(&mut self.poisson, POISSON.0..=POISSON.1).max_decimals(2);
            young |= line(ui, "Poisson's ratio", slider);
            let slider = Slider::new(&mut self.size_mm, SIZE_MM.0..=SIZE_MM.1);
            let mut object = line(ui, "size", slider.suffix(" mm").max_decimals(0));
            ui.add_enabled_ui(is.can_be_refined, |ui| {
                let slider = Slider::new(&mut self.nodes, NODES.0..=NODES.1).logarithmic(true);
                object |= line(ui, "nodes", slider);
            });
            ui.label(match is.grip_newtons {
                Some(newtons) => format!("The grip takes {newtons:.2} N."),
                None => "Squeeze it to see the force of the grip.".to_owned(),
            });
            match (young, object) {
                (true, _) => self.other_material(is),
                (false, true) => self.other_object(is),
                (false, false) => None,
            }
        })
    }

    /// The wish for another material than the object has; a slider that only rounds what it shows wants
    /// none.
    fn other_material(&self, is: &Is) -> Option<SoftnessWish> {
        let (young, poisson) = (1e3 * self.young_kpa, self.poisson);
        let differs = (young / is.young - 1.0).abs() > 5e-3 || (poisson - is.poisson).abs() > 5e-3;
        differs.then_some(SoftnessWish::Material { young, poisson })
    }

    /// The wish for another size or number of nodes than the object has.
    fn other_object(&self, is: &Is) -> Option<SoftnessWish> {
        let differs = (self.size_mm - 1e3 * is.size_m).abs() > 0.6 || self.nodes != is.nodes;
        differs.then(|| SoftnessWish::Object {
            nodes: is.can_be_refined.then_some(self.nodes),
            size_m: 1e-3 * self.size_mm,
        })
    }

    /// Sets the sliders to what has changed elsewhere.
    fn follow(&mut self, is: &Is) {
        let new = Is { grip_newtons: None, ..*is };
        if self.seen == Some(new) {
            return;
        }
        self.seen = Some(new);
        (self.young_kpa, self.poisson) = (1e-3 * is.young, is.poisson);
        (self.size_mm, self.nodes) = (1e3 * is.size_m, is.nodes);
    }
}

/// Shows a slider with its name; returns whether it was let go after a change.
fn line(ui: &mut Ui, name: &str, slider: Slider<'_>) -> bool {
    ui.horizontal(|ui| {
        ui.spacing_mut().slider_width = 110.0;
        let response = ui.add(slider);
        places::tell(ui.ctx(), name, &response);
        ui.label(name);
        is_settled(&response)
    })
    .inner
}

/// Whether a slider was let go: while it is moved, every value between would be asked for.
fn is_settled(response: &Response) -> bool {
    response.drag_stopped() || (response.changed() && !response.dragged())
}

fn like(young_kpa: f64) -> &'static str {
    LIKE.iter().find(|(most, _)| young_kpa <= *most).map_or("", |(_, name)| *name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sponge_is_softer_than_fruit_and_fruit_than_rubber() {
        let names = [2.0, 20.0, 1000.0].map(like);
        assert_eq!(names, ["like a kitchen sponge", "like a soft fruit", "like rubber"]);
    }

    #[test]
    fn sliders_follow_another_object_but_not_the_force_of_each_tick() {
        let is = Is {
            young: 2e4,
            poisson: 0.4,
            size_m: 0.08,
            nodes: 1000,
            can_be_refined: true,
            grip_newtons: None,
        };
        let mut softness = Softness::default();
        softness.follow(&is);
        softness.young_kpa = 55.0;
        softness.follow(&Is { grip_newtons: Some(1.5), ..is });
        assert_eq!(softness.young_kpa, 55.0, "a slider that is drawn stays");
        let wish = softness.other_material(&is);
        assert_eq!(wish, Some(SoftnessWish::Material { young: 55e3, poisson: 0.4 }));
        softness.size_mm = 80.3;
        assert_eq!(softness.other_object(&is), None, "a card that is opened loads no other object");
        softness.follow(&Is { nodes: 64, ..is });
        assert_eq!((softness.young_kpa, softness.nodes), (20.0, 64));
    }
}
