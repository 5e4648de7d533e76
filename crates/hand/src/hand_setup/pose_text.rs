//! A pose in a configuration: a translation in metres and one of two ways to write a rotation.

use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};

use super::error::HandFileError;

/// The numbers of a pose as they stand in a table of the file.
#[derive(Clone, Copy, Debug)]
pub(super) struct PoseNumbers {
    pub(super) translation_m: [f64; 3],
    pub(super) quaternion_wxyz: Option<[f64; 4]>,
    pub(super) rotation_vector_deg: Option<[f64; 3]>,
}

/// Names of one such table, and how far its translation may reach.
#[derive(Clone, Copy, Debug)]
pub(super) struct PoseTable {
    pub(super) table: &'static str,
    pub(super) translation_key: &'static str,
    pub(super) quaternion_key: &'static str,
    pub(super) vector_key: &'static str,
    pub(super) reach_m: f64,
    pub(super) reach: &'static str,
}

impl PoseTable {
    /// The receiver's place on the arm.
    pub(super) const MOUNT: Self = Self {
        table: "mount",
        translation_key: "mount.translation_m",
        quaternion_key: "mount.quaternion_wxyz",
        vector_key: "mount.rotation_vector_deg",
        reach_m: 0.5,
        reach: "three numbers, at most 0.5 m from the receiver",
    };
    /// The transmitter's place in the world.
    pub(super) const STAND: Self = Self {
        table: "world_from_stand",
        translation_key: "world_from_stand.translation_m",
        quaternion_key: "world_from_stand.quaternion_wxyz",
        vector_key: "world_from_stand.rotation_vector_deg",
        reach_m: 10.0,
        reach: "three numbers, at most 10 m from the origin",
    };

    /// The pose that the numbers mean.
    pub(super) fn pose(&self, numbers: &PoseNumbers) -> Result<Isometry3<f64>, HandFileError> {
        let translation = Vector3::from(numbers.translation_m);
        // Written so that a length that is not a number is refused.
        let is_near = translation.norm() <= self.reach_m;
        if !is_near {
            let found = numbers.translation_m;
            return Err(HandFileError::value(self.translation_key, found, self.reach));
        }
        let rotation = match (numbers.quaternion_wxyz, numbers.rotation_vector_deg) {
            (Some(q), None) => self.rotation_of_quaternion(q)?,
            (None, Some(vector)) => self.rotation_of_vector(vector)?,
            (None, None) => return Err(HandFileError::Rotation { table: self.table, found: 0 }),
            (Some(_), Some(_)) => {
                return Err(HandFileError::Rotation { table: self.table, found: 2 });
            }
        };
        Ok(Isometry3::from_parts(translation.into(), rotation))
    }

    fn rotation_of_quaternion(&self, wxyz: [f64; 4]) -> Result<UnitQuaternion<f64>, HandFileError> {
        let [w, x, y, z] = wxyz;
        let quaternion = Quaternion::new(w, x, y, z);
        let length = quaternion.norm();
        // Numbers copied by hand have few digits; others were meant as something else.
        if !(0.99..=1.01).contains(&length) {
            let expected = "a quaternion of length 1, scalar first";
            return Err(HandFileError::value(self.quaternion_key, wxyz, expected));
        }
        // Numbers that are exact must come back exactly.
        let exact = (length - 1.0).abs() <= 1e-15;
        Ok(match exact {
            true => UnitQuaternion::new_unchecked(quaternion),
            false => UnitQuaternion::new_normalize(quaternion),
        })
    }

    fn rotation_of_vector(&self, degrees: [f64; 3]) -> Result<UnitQuaternion<f64>, HandFileError> {
        let vector = Vector3::from(degrees.map(f64::to_radians));
        let is_sound = vector.norm() <= std::f64::consts::TAU;
        if !is_sound {
            let expected = "an axis times an angle of at most 360 degrees";
            return Err(HandFileError::value(self.vector_key, degrees, expected));
        }
        Ok(UnitQuaternion::from_scaled_axis(vector))
    }
}

/// The lines of a pose in the file.
pub(super) fn pose_lines(pose: &Isometry3<f64>) -> String {
    let translation: [f64; 3] = pose.translation.vector.into();
    let q = pose.rotation.quaternion();
    let wxyz = [q.w, q.i, q.j, q.k];
    format!("translation_m = {translation:?}\nquaternion_wxyz = {wxyz:?}\n")
}
