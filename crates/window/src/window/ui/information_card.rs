//! What runs and where (F2): object, material, equations, server, why this method.

use egui::{Align2, Context, Grid, Ui};

use super::theme;
use crate::view::frame::ViewFrame;

/// What does not change from frame to frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunFacts {
    /// Name or file of the object.
    pub object: String,
    /// Young's modulus, Pa, and Poisson's ratio.
    pub material: (f64, f64),
    /// What a fingertip holds.
    pub contact: String,
    /// Where it is solved.
    pub server: String,
    /// The hand.
    pub hand: String,
    /// What draws.
    pub graphics: String,
}

/// Shows the card.
pub fn show(context: &Context, facts: &RunFacts, frame: Option<&ViewFrame>) {
    let offset = [-theme::MARGIN, -theme::MARGIN - 64.0];
    theme::card(context, "information", Align2::RIGHT_BOTTOM, offset, |ui| {
        ui.set_max_width(420.0);
        ui.strong("Information");
        Grid::new("information grid").num_columns(2).spacing([14.0, 3.0]).show(ui, |ui| {
            of_run(ui, facts);
            if let Some(frame) = frame {
                of_frame(ui, frame);
            }
        });
        if let Some(solve) = frame.and_then(|frame| frame.server.solve.as_ref()) {
            ui.label(theme::quiet(&solve.chosen_because));
            for warning in &solve.warnings {
                ui.colored_label(theme::CAUTION, warning);
            }
        }
    });
}

fn row(ui: &mut Ui, name: &str, value: impl Into<String>) {
    ui.label(theme::quiet(name));
    ui.label(value.into());
    ui.end_row();
}

fn of_run(ui: &mut Ui, facts: &RunFacts) {
    let (young, poisson) = facts.material;
    row(ui, "object", facts.object.clone());
    row(ui, "material", format!("{} kPa, Poisson's ratio {poisson}", young / 1e3));
    row(ui, "hand", format!("{}, holds by {}", facts.hand, facts.contact));
    row(ui, "server", facts.server.clone());
    row(ui, "drawn by", facts.graphics.clone());
}

fn of_frame(ui: &mut Ui, frame: &ViewFrame) {
    let mesh = frame.object.rest.mesh();
    let size = 1e3 * mesh.size();
    let counts =
        format!("{} nodes, {} tetrahedra, {size:.0} mm", mesh.node_count(), mesh.tets().len());
    row(ui, "mesh", counts);
    row(ui, "shape at rest", format!("number {}", frame.object.rest_shapes));
    let Some(solve) = &frame.server.solve else { return };
    let equations = format!("{} unknown, {} prescribed", solve.unknown_dofs, solve.known_dofs);
    row(ui, "equations", equations);
    row(ui, "precision", solve.precision.clone());
    let turned = match solve.max_rotation_deg.is_finite() {
        true => format!("{:.1}°, {:.0} %", solve.max_rotation_deg, 100.0 * solve.max_strain),
        false => "–".to_owned(),
    };
    row(ui, "largest turn, strain", turned);
}
