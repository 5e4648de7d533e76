//! How well the steps of a grasp by friction met the law of contact, for each step and for the run.

use nalgebra::Vector3;
use serde::Serialize;
use softgrasp_protocol::{BodyLoad, ContactReport};

/// Record of one answered step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct StepRecord {
    /// Tick that asked for the step.
    pub tick: u64,
    /// Force of each finger on the object, N, thumb first.
    pub finger_force_n: [f64; 5],
    /// Force of the palm on the object, N.
    pub palm_force_n: f64,
    /// Forces of the second hand; absent in a step without one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub second_hand: Option<HandForces>,
    /// Force of the table on the object, N.
    pub table_force_n: f64,
    /// Number of points that press.
    pub contacts: u32,
    /// Deepest point of the surface in a body, m.
    pub penetration_max_m: f64,
    /// Longest slip of a pressing point in the step, m.
    pub slip_max_m: f64,
    /// Largest residual of the law of Signorini and Coulomb, N.
    pub residual_n: f64,
    /// Residual of the law of contact, relative to the largest force of a point.
    pub residual_rel: f64,
    /// Largest part of a force outside its cone of friction, N.
    pub cone_violation_n: f64,
    /// Whether penetration and residual are within what was asked for.
    pub converged: bool,
    /// Number of times that the contact problem was made.
    pub rounds: u32,
    /// Number of steps of Newton's method.
    pub newton_steps: u32,
    /// Whether the elastic part was solved at large deformation.
    pub large: bool,
    /// Largest accumulated plastic strain, 0 without a yield stress.
    pub plastic_strain: f64,
    /// Time from sending the request to having the answer, ms.
    pub round_trip_ms: f64,
}

/// Forces of a hand on the object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct HandForces {
    /// Force of each finger, N, thumb first.
    pub finger_force_n: [f64; 5],
    /// Force of the palm, N.
    pub palm_force_n: f64,
}

/// Loads of a hand in one step.
pub struct HandLoads<'a> {
    fingers: [&'a [BodyLoad]; 5],
    palm: &'a [BodyLoad],
}

impl<'a> HandLoads<'a> {
    /// Loads of a hand, by finger, thumb first, and of its palm.
    pub fn of(of_finger: impl Fn(usize) -> &'a [BodyLoad], palm: &'a [BodyLoad]) -> Self {
        Self { fingers: std::array::from_fn(of_finger), palm }
    }

    fn forces(&self) -> HandForces {
        HandForces { finger_force_n: self.fingers.map(force_n), palm_force_n: force_n(self.palm) }
    }

    fn contacts(&self) -> u32 {
        let all = self.fingers.iter().copied().chain([self.palm]).flatten();
        all.map(|load| load.contacts).sum()
    }
}

/// Force of several bodies together, N.
fn force_n(loads: &[BodyLoad]) -> f64 {
    loads.iter().map(|load| Vector3::from(load.force)).sum::<Vector3<f64>>().norm()
}

/// Totals of all answered steps of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ContactTotals {
    /// Number of answered steps.
    pub steps: u64,
    /// Number of steps at large deformation; the others were linear.
    pub large: u64,
    /// Largest accumulated plastic strain, 0 without a yield stress.
    pub plastic_strain_max: f64,
    /// Number of steps whose penetration or residual is above what was asked for.
    pub not_converged: u64,
    /// Deepest point of the surface in a body, m.
    pub penetration_max_m: f64,
    /// Largest residual of the law of contact, relative to the largest force of its step.
    pub residual_rel_max: f64,
    /// Largest residual of the law of contact, N.
    pub residual_max_n: f64,
    /// Largest part of a force outside its cone of friction, N.
    pub cone_violation_max_n: f64,
    /// Largest force of a finger, N.
    pub finger_force_max_n: f64,
}

impl StepRecord {
    /// Record of a step, of the loads of the table and of both hands; `None` where there was no second one.
    pub fn new(
        tick: u64,
        round_trip_ms: f64,
        report: &ContactReport,
        table: &[BodyLoad],
        (first, second): (HandLoads<'_>, Option<HandLoads<'_>>),
    ) -> Self {
        let HandForces { finger_force_n, palm_force_n } = first.forces();
        let of_table: u32 = table.iter().map(|load| load.contacts).sum();
        let of_second = second.as_ref().map_or(0, HandLoads::contacts);
        Self {
            tick,
            finger_force_n,
            palm_force_n,
            second_hand: second.as_ref().map(HandLoads::forces),
            table_force_n: force_n(table),
            contacts: of_table + first.contacts() + of_second,
            penetration_max_m: report.penetration_max,
            slip_max_m: report.slip_max,
            residual_n: report.residual,
            residual_rel: report.residual_rel,
            cone_violation_n: report.cone_violation,
            converged: report.is_converged,
            rounds: report.rounds,
            newton_steps: report.newton_steps,
            large: report.is_large,
            plastic_strain: report.plastic_strain,
            round_trip_ms,
        }
    }
}

impl ContactTotals {
    /// Adds a step to the totals.
    pub fn add(&mut self, step: &StepRecord) {
        self.steps += 1;
        self.large += u64::from(step.large);
        self.plastic_strain_max = self.plastic_strain_max.max(step.plastic_strain);
        self.not_converged += u64::from(!step.converged);
        self.penetration_max_m = self.penetration_max_m.max(step.penetration_max_m);
        self.residual_rel_max = self.residual_rel_max.max(step.residual_rel);
        self.residual_max_n = self.residual_max_n.max(step.residual_n);
        self.cone_violation_max_n = self.cone_violation_max_n.max(step.cone_violation_n);
        let of_second = step.second_hand.map_or([0.0; 5], |hand| hand.finger_force_n);
        let force = step.finger_force_n.into_iter().chain(of_second).fold(0.0, f64::max);
        self.finger_force_max_n = self.finger_force_max_n.max(force);
    }

    /// Totals as text for the summary; empty if there was no step.
    pub fn words(&self) -> String {
        if self.steps == 0 {
            return String::new();
        }
        let large = match (self.large, self.plastic_strain_max) {
            (0, _) => String::new(),
            (steps, 0.0) => format!("  large deformation   {steps} of {} steps\n", self.steps),
            (steps, flowed) => format!(
                "  large deformation   {steps} of {} steps; {:.1} % of plastic strain at most\n",
                self.steps,
                100.0 * flowed,
            ),
        };
        let told = format!(
            "  contact             {} steps, surface at most {:.1e} m deep, law of contact met to {:.1e} N \
             ({:.1e} of the largest force), {} steps above what was asked for\n  \
             finger force        {:.2} N at most\n",
            self.steps,
            self.penetration_max_m,
            self.residual_max_n,
            self.residual_rel_max,
            self.not_converged,
            self.finger_force_max_n,
        );
        told + &large
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn totals_hold_the_worst_of_all_steps() {
        let load =
            |force: f64| BodyLoad { force: [0.0, force, 0.0], contacts: 2, ..BodyLoad::default() };
        let (table, thumb, palm) = ([load(1.0)], [load(0.3), load(0.4)], [load(0.0)]);
        let mut totals = ContactTotals::default();
        assert!(totals.words().is_empty());
        for (tick, residual) in [(1, 2e-3), (2, 1e-6)] {
            let report = ContactReport {
                residual,
                is_converged: residual < 1e-4,
                ..ContactReport::default()
            };
            let hand = || HandLoads::of(|digit| if digit == 0 { &thumb[..] } else { &[] }, &palm);
            let step = StepRecord::new(tick, 1.0, &report, &table, (hand(), None));
            assert!((step.finger_force_n[0] - 0.7).abs() < 1e-12 && step.contacts == 8);
            let both = StepRecord::new(tick, 1.0, &report, &table, (hand(), Some(hand())));
            assert_eq!((both.contacts, both.finger_force_n), (14, step.finger_force_n));
            assert_eq!(both.second_hand.map(|hand| hand.finger_force_n), Some(step.finger_force_n));
            totals.add(&step);
        }
        assert_eq!((totals.steps, totals.not_converged, totals.residual_max_n), (2, 1, 2e-3));
        assert!(totals.words().contains("1 steps above"));
    }
}
