//! Turns the fields of a contact frame from the object's axes into those of the world.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use softgrasp_protocol::{Field, FieldValues};

/// Stress and contact force rotated into the axes of the world; strain stays in the axes of the object at
/// rest, as its mesh does.
pub fn in_world(mut fields: FieldValues, world_from_object: &UnitQuaternion<f64>) -> FieldValues {
    let turn = world_from_object.to_rotation_matrix();
    for (field, values) in &mut fields.arrays {
        match field {
            Field::ElementStress | Field::NodeStress => {
                for tensor in values.as_chunks_mut::<6>().0 {
                    *tensor = turned(turn.matrix(), tensor);
                }
            }
            Field::ContactForce => {
                for force in values.as_chunks_mut::<3>().0 {
                    *force = (turn * Vector3::from(*force)).into();
                }
            }
            _ => {}
        }
    }
    fields
}

/// Rotated tensor `R σ Rᵀ`, for the components `xx yy zz xy yz zx`.
fn turned(turn: &Matrix3<f64>, [xx, yy, zz, xy, yz, zx]: &[f64; 6]) -> [f64; 6] {
    let m = Matrix3::new(*xx, *xy, *zx, *xy, *yy, *yz, *zx, *yz, *zz);
    let m = turn * m * turn.transpose();
    [m[(0, 0)], m[(1, 1)], m[(2, 2)], m[(0, 1)], m[(1, 2)], m[(0, 2)]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_turn_about_z_takes_x_to_y() {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2);
        let fields = FieldValues {
            energy: 1.0,
            error_rel: 0.5,
            arrays: vec![
                (Field::ElementStrain, vec![1.0; 6]),
                (Field::NodeStress, vec![5.0, 2.0, 3.0, 0.5, 0.25, -1.0]),
                (Field::ContactForce, vec![1.0, 2.0, 3.0]),
            ],
        };
        let world = in_world(fields, &turn);
        let near = |field: Field, expected: &[f64]| {
            let own = world.get(field).unwrap();
            assert!(own.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-14), "{own:?}");
        };
        near(Field::ElementStrain, &[1.0; 6]);
        near(Field::NodeStress, &[2.0, 5.0, 3.0, -0.5, -1.0, -0.25]);
        near(Field::ContactForce, &[-2.0, 1.0, 3.0]);
    }
}
