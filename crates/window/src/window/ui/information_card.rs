//! What runs and where (F2): object, material, equations, server, why this method.

use egui::{Grid, RichText, Ui};

use super::theme;
use crate::view::frame::ViewFrame;

/// Facts of a run that do not change from tick to tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunFacts {
    /// Name or file of the object.
    pub object: String,
    /// Young's modulus, Pa, and Poisson's ratio.
    pub material: (f64, f64),
    /// Words for how the hand holds the object: by friction, or by what a fingertip holds.
    pub contact: String,
    /// Server that answers, as it is shown to a person.
    pub server: String,
    /// Kind of the hand that acts.
    pub hand: String,
    /// Name of the graphics that draw.
    pub graphics: String,
}

/// Shows the card.
pub fn show(ui: &mut Ui, facts: &RunFacts, frame: Option<&ViewFrame>) {
    theme::sheet(ui, |ui| {
        ui.set_max_width(340.0);
        ui.strong("Information");
        Grid::new("information grid").num_columns(2).spacing([14.0, 3.0]).show(ui, |ui| {
            of_run(ui, facts);
            if let Some(frame) = frame {
                of_frame(ui, frame);
            }
        });
        if let Some(solve) = frame.and_then(|frame| frame.server.solve.as_ref()) {
            ui.label(theme::quiet(&solve.report.chosen_because));
            for warning in &solve.report.warnings {
                ui.colored_label(theme::CAUTION, &warning.text);
            }
        }
    });
}

fn row(ui: &mut Ui, name: &str, value: impl Into<String>) {
    ui.label(theme::quiet(name));
    ui.add(egui::Label::new(RichText::new(value.into())).wrap());
    ui.end_row();
}

fn of_run(ui: &mut Ui, facts: &RunFacts) {
    let (young, poisson) = facts.material;
    row(ui, "object", facts.object.clone());
    row(ui, "material", format!("{} kPa, Poisson's ratio {poisson}", young / 1e3));
    row(ui, "hand", format!("{}; {}", facts.hand, facts.contact));
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
    row(ui, "tick", format!("{}  ({:.1} s)", frame.tick, frame.at_s));
    row(ui, "ticks missed", frame.server.ticks_skipped.to_string());
    row(ui, "unreadable records", frame.server.device_faults.to_string());
    row(ui, "link", frame.server.link.name());
    if let Some(said) = &frame.server.said {
        row(ui, "server says", said.clone());
    }
    let Some(solve) = &frame.server.solve else { return };
    let equations =
        format!("{} unknown, {} prescribed", solve.report.unknown_dofs, solve.report.known_dofs);
    row(ui, "equations", equations);
    row(ui, "method", format!("{} on {}", solve.report.method, solve.report.element));
    row(ui, "question to answer", format!("{:.2} ms", solve.round_trip_ms));
    row(ui, "residual", format!("{:.1e}", solve.report.residual_rel));
    let bound = match (solve.report.error_bound_rel, &solve.report.error_bound_why) {
        (Some(bound), _) => format!("{bound:.1e}, proven"),
        (None, Some(why)) => format!("none: {why}"),
        (None, None) => "none for this answer".to_owned(),
    };
    row(ui, "bound of the error", bound);
    row(ui, "precision", solve.report.precision.clone());
    let turned = match solve.report.max_rotation_deg.is_finite() {
        true => format!(
            "{:.1}°, {:.0} %",
            solve.report.max_rotation_deg,
            100.0 * solve.report.max_strain
        ),
        false => "–".to_owned(),
    };
    row(ui, "largest turn, strain", turned);
}
