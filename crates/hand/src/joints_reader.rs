//! Reads a hand from a stream of joints.

use nalgebra::{Isometry3, Translation3, Vector3};
use serde::Serialize;
use softgrasp_grasp::hand::{HandDimensions, HandPose, pose};

use crate::joints::{
    FittedHand, HandFit, JointsEvent, JointsParser, JointsRecord, fitted_dimensions,
};

/// Joints of one hand, and the kinematic hand that follows them.
pub struct JointsReader {
    parser: JointsParser,
    fit: HandFit,
    /// Records that the hand is measured by, until there are enough.
    measured: Vec<JointsRecord>,
    /// Where the sender's frame lies in the world; `None` until the first hand.
    world_from_sender: Option<Isometry3<f64>>,
    newest: Option<(FittedHand, f64)>,
    faults: u64,
    fit_errors: FitErrors,
}

/// How well the hand fits, over a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FitErrors {
    /// Records that were fitted.
    pub records: u64,
    /// Root of the mean squared distance of joints, over all records, m.
    pub rms_m: f64,
    /// Largest distance of a joint, m.
    pub most_m: f64,
}

/// A hand is measured by so many records, and is of the usual size before.
const MEASURED: usize = 30;
/// The first palm is placed here in the world, m: before the object, to the right of its middle.
const FIRST_PALM_M: Vector3<f64> = Vector3::new(0.0, 0.08, 0.16);

impl JointsReader {
    /// A reader for a hand; its size is taken from the stream.
    ///
    /// Frame: `world_from_sender` places the sender's frame; `None` places the first palm before the
    /// object.
    pub fn new(dimensions: HandDimensions, world_from_sender: Option<Isometry3<f64>>) -> Self {
        Self {
            parser: JointsParser::new(),
            fit: HandFit::new(dimensions),
            measured: Vec::new(),
            world_from_sender,
            newest: None,
            faults: 0,
            fit_errors: FitErrors::default(),
        }
    }

    /// Takes bytes that came at a time, s.
    pub fn feed(&mut self, bytes: &[u8], is_datagram: bool, time_s: f64) {
        let mut records = Vec::new();
        let mut faults = 0;
        let mut on_event = |event| match event {
            JointsEvent::Record(record) => records.push(*record),
            JointsEvent::Fault(fault) => {
                tracing::debug!(?fault, "joints");
                faults += 1;
            }
        };
        if is_datagram {
            self.parser.feed_datagram(bytes, &mut on_event);
        } else {
            self.parser.feed_all(bytes, &mut on_event);
        }
        self.faults += faults;
        records.iter().for_each(|record| self.follow(record, time_s));
    }

    /// Bad lines, and records that no hand fits.
    pub fn faults(&self) -> u64 {
        self.faults
    }

    /// How well the hand fits.
    pub fn fit_errors(&self) -> FitErrors {
        self.fit_errors
    }

    /// Dimensions of the hand.
    pub fn dimensions(&self) -> &HandDimensions {
        self.fit.dimensions()
    }

    /// When the newest record came, s.
    pub fn time_s(&self) -> Option<f64> {
        self.newest.map(|(_, time_s)| time_s)
    }

    /// Pose of the hand by the newest record.
    pub fn hand(&self) -> Option<HandPose> {
        let (fitted, _) = self.newest?;
        let world_from_palm = self.world_from_sender? * fitted.world_from_palm;
        Some(pose(self.fit.dimensions(), &fitted.angles, world_from_palm))
    }

    fn follow(&mut self, record: &JointsRecord, time_s: f64) {
        self.measure(record);
        match self.fit.fit(record) {
            Ok(fitted) => {
                self.world_from_sender.get_or_insert_with(|| {
                    let first = fitted.world_from_palm.translation.vector;
                    Translation3::from(FIRST_PALM_M - first).into()
                });
                self.newest = Some((fitted, time_s));
                let errors = &mut self.fit_errors;
                let squares = errors.rms_m.powi(2) * errors.records as f64;
                errors.records += 1;
                let mean = (squares + fitted.fit_error_rms_m.powi(2)) / errors.records as f64;
                errors.rms_m = mean.sqrt();
                errors.most_m = errors.most_m.max(fitted.fit_error_max_m);
            }
            Err(error) => {
                tracing::debug!(%error, "joints");
                self.faults += 1;
            }
        }
    }

    /// Takes the hand's side from the first record and its size from the first ones.
    fn measure(&mut self, record: &JointsRecord) {
        if self.measured.len() >= MEASURED {
            return;
        }
        if self.measured.is_empty() {
            let dimensions = self.fit.dimensions().with_handedness(record.hand);
            self.fit = HandFit::new(dimensions);
        }
        let same_hand = self.measured.first().is_none_or(|first| first.hand == record.hand);
        if same_hand {
            self.measured.push(*record);
        }
        if self.measured.len() == MEASURED
            && let Ok(dimensions) = fitted_dimensions(&self.measured)
        {
            self.fit = HandFit::new(dimensions);
        }
    }
}
