//! How much of a grip stays when the shape that it presses is kept as the rest shape.

use nalgebra::{Matrix3, Point3, SymmetricEigen, U3, Vector3};
use softgrasp_grasp::object::SoftObject;
use softgrasp_hand::scripted::GRIP_MARGIN;
use softgrasp_protocol::{HeldContact, ObjectState};

use crate::run::contact_scene::ContactScene;

/// The grip of the hands on an object in the shape that is to be kept. Frame: the object's.
///
/// A kept shape presses back against nobody: fingers go on pressing only as far as they had given way
/// themselves, and a soft object slides out of the hand that had dented it. So where friction needs it, a share
/// of the displacement is not kept: it goes on pressing, and springs back when the hand opens.
pub(crate) struct KeptGrip {
    /// Coefficient of friction of the hands.
    friction: f64,
    /// Direction against gravity.
    up: Vector3<f64>,
    /// Sum over the hands' bodies of force times the way by which the body gives way to it, J.
    given_way: f64,
    contacts: Vec<GripContact>,
}

/// A contact of a hand.
struct GripContact {
    /// Where it is, m.
    place: Point3<f64>,
    /// Force on the object, N.
    force: Vector3<f64>,
    /// Unit vector into the object.
    inward: Vector3<f64>,
    /// Part of the force along it, N.
    normal_force: f64,
    /// Displacement of the object there, m.
    displacement: Vector3<f64>,
}

/// Share of the inertia of all contacts that counts as one about every line.
const ON_A_LINE: f64 = 1e-6;
/// Steps of an eigenvalue of three: more than it ever takes.
const EIGEN_STEPS_MAX: usize = 100;

impl KeptGrip {
    /// Grip of hands that press on an object with these forces on their bodies, N, at these contacts.
    ///
    /// Frame: `up` and the contacts in the object's.
    pub(crate) fn new<'c>(
        (scene, up): (&ContactScene, Vector3<f64>),
        body_forces: impl Iterator<Item = Vector3<f64>>,
        contacts: impl Iterator<Item = &'c HeldContact>,
        object: &SoftObject,
    ) -> Self {
        let of_body = |force: Vector3<f64>| scene.finger_compliance * force.norm_squared();
        let given_way = body_forces.map(of_body).sum();
        let contacts = contacts.map(|contact| GripContact::new(contact, object)).collect();
        Self { friction: scene.friction, up, given_way, contacts }
    }

    /// Share of the displacement that is not to become a part of the rest shape, at most 1: 0 where the grip
    /// holds the object without.
    ///
    /// Friction is to hold the object as many times over as where the scripted hand lifts. With a share s of its
    /// displacement left the object presses with s of its force in the place where it is, and hand and object
    /// go to the equilibrium of their springs in series: the forces become the part
    /// `(given_way + s pressed_in)/(given_way + pressed_in)` of what they were.
    pub(crate) fn share_left(&self) -> f64 {
        let pressed_in: f64 = self.contacts.iter().map(|c| c.force.dot(&c.displacement)).sum();
        let needed = GRIP_MARGIN * self.friction_used();
        // Written so that what is no number leaves nothing.
        let is_pressed = needed > 0.0 && pressed_in > 0.0;
        if !is_pressed {
            return 0.0;
        }
        let both = self.given_way + pressed_in;
        ((needed * both - self.given_way) / pressed_in).clamp(0.0, 1.0)
    }

    /// Share of the friction of the contacts that carries the object; 0 where the hands do not carry it.
    ///
    /// The forces that press the object together have neither a sum nor a torque. What has both is carried by
    /// every contact in proportion to its normal force, as by a rigid body that begins to slip; only what acts
    /// along the axis of the pinch is left to the normal forces. A sum and a torque use friction up together
    /// like the axes of an ellipse (Howe and Cutkosky 1996, limit surface).
    fn friction_used(&self) -> f64 {
        let normal_force: f64 = self.contacts.iter().map(|c| c.normal_force).sum();
        let carried: Vector3<f64> = self.contacts.iter().map(|c| c.force).sum();
        let carries = normal_force > 0.0 && carried.dot(&self.up) > 0.0;
        if !carries {
            return 0.0;
        }
        let weighted = |c: &GripContact| c.normal_force * c.place.coords;
        let centre = self.contacts.iter().map(weighted).sum::<Vector3<f64>>() / normal_force;
        let (mut torque, mut inertia) = (Vector3::zeros(), Matrix3::zeros());
        for contact in &self.contacts {
            let arm = contact.place.coords - centre;
            torque += arm.cross(&contact.force);
            let own = arm.norm_squared() * Matrix3::identity() - arm * arm.transpose();
            inertia += contact.normal_force * own;
        }
        // Contacts on one line bear no torque about it; rounding must not be divided by nothing.
        inertia += Matrix3::identity() * (ON_A_LINE * inertia.trace());
        let turn = inertia.try_inverse().map_or(Vector3::zeros(), |inverse| inverse * torque);
        let axis = self.axis();
        let along = carried / normal_force;
        let of_contact = |c: &GripContact| {
            let force = along + turn.cross(&(c.place.coords - centre));
            c.normal_force * (force - axis * axis.dot(&force)).norm_squared()
        };
        let mean_square = self.contacts.iter().map(of_contact).sum::<f64>() / normal_force;
        mean_square.sqrt() / self.friction
    }

    /// Direction in which most of the normal forces press; none where they are no numbers.
    fn axis(&self) -> Vector3<f64> {
        let of_contact = |c: &GripContact| c.normal_force * c.inward * c.inward.transpose();
        let pressed: Matrix3<f64> = self.contacts.iter().map(of_contact).sum();
        let eigen = pressed.try_symmetric_eigen(f64::EPSILON, EIGEN_STEPS_MAX);
        let of_largest =
            |e: SymmetricEigen<f64, U3>| e.eigenvectors.column(e.eigenvalues.imax()).into();
        eigen.map_or(Vector3::zeros(), of_largest)
    }
}

impl GripContact {
    fn new(held: &HeldContact, object: &SoftObject) -> Self {
        let at = |values: &dyn Fn(usize) -> Option<Vector3<f64>>| {
            let corners = held.nodes.iter().zip(held.weights);
            let of_corner =
                |(&node, weight): (&u32, f64)| weight * values(node as usize).unwrap_or_default();
            corners.map(of_corner).sum::<Vector3<f64>>()
        };
        let outward = at(&|node| object.normals().get(node).copied());
        let force = Vector3::from(held.force);
        let inward = -outward.try_normalize(0.0).unwrap_or_default();
        Self {
            place: at(&|node| object.shape().get(node).map(|place| place.coords)).into(),
            force,
            inward,
            normal_force: force.dot(&inward).max(0.0),
            displacement: at(&|node| object.displacement().get(node).map(|&u| u.into())),
        }
    }
}

/// State of an object at rest in its pose, on which a share of its forces and contacts goes on.
pub(crate) fn pressing_on(before: &ObjectState, share: f64) -> ObjectState {
    let mut state = ObjectState::at_rest(before.pose);
    if share > 0.0 {
        let scaled = |force: [f64; 3]| force.map(|f| share * f);
        state.force_nodes.clone_from(&before.force_nodes);
        state.forces = before.forces.iter().copied().map(scaled).collect();
        let of_contact = |c: &HeldContact| HeldContact { force: scaled(c.force), ..*c };
        state.contacts = before.contacts.iter().map(of_contact).collect();
    }
    state
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two fingers that press by 2 N each on an object of 500 N/m and 60 mm, give way by 1 mm/N, and carry some
    /// newtons, a way beside them: each at two points 10 mm apart.
    fn pinch(carried: f64, beside: f64) -> KeptGrip {
        let mut contacts = Vec::new();
        for side in [1.0, -1.0] {
            for along in [5e-3, -5e-3] {
                let place = Point3::new(-side * 0.03, 0.0, along);
                // A load beside the fingers turns the object about the line between them.
                let turning = 0.25 * carried * beside / along;
                let force = Vector3::new(side, 0.25 * carried - turning, 0.0);
                let displacement = Vector3::x() * side * 4e-3;
                let inward = side * Vector3::x();
                contacts.push(GripContact {
                    place,
                    force,
                    inward,
                    normal_force: 1.0,
                    displacement,
                });
            }
        }
        let given_way = 2.0 * 2.0 * 2e-3;
        KeptGrip { friction: 0.8, up: Vector3::y(), given_way, contacts }
    }

    #[test]
    fn friction_carries_the_load_and_its_torque() {
        assert!((pinch(1.2, 0.0).friction_used() - 1.2 / (0.8 * 4.0)).abs() < 1e-12);
        // A torque that asks every contact for as much as the load does.
        assert!((pinch(1.2, 5e-3).friction_used() - 2f64.sqrt() * 1.2 / (0.8 * 4.0)).abs() < 1e-3);
        assert_eq!(pinch(-1.2, 0.0).friction_used(), 0.0);
        // One point on either side bears no torque about the line between them.
        let mut points = pinch(1.2, 0.0);
        points.contacts.retain(|contact| contact.place.z > 0.0);
        assert!((points.friction_used() - 0.6 / (0.8 * 2.0)).abs() < 1e-12);
    }

    #[test]
    fn friction_carries_nothing_of_an_object_that_lies_on_the_hand() {
        let lying =
            KeptGrip { up: Vector3::x(), contacts: pinch(0.0, 0.0).contacts, ..pinch(0.0, 0.0) };
        let lying = KeptGrip {
            contacts: lying.contacts.into_iter().filter(|c| c.force.x > 0.0).collect(),
            ..lying
        };
        assert!(lying.friction_used() < 1e-12);
    }

    #[test]
    fn all_is_kept_where_the_fingers_press_on_by_themselves() {
        // A third of the forces is left, 1.33 N: friction holds 1.07 N on either side.
        assert_eq!(pinch(0.4, 0.0).share_left(), 0.0);
        assert_eq!(pinch(0.0, 0.0).share_left(), 0.0);
        let nothing = KeptGrip { contacts: Vec::new(), ..pinch(1.0, 0.0) };
        assert_eq!(nothing.share_left(), 0.0);
    }

    #[test]
    fn as_much_is_left_as_friction_needs_to_hold_the_load() {
        let (carried, grip) = (1.0, pinch(1.0, 0.0));
        let share = grip.share_left();
        assert!((0.1..0.9).contains(&share), "{share}");
        // Springs in series from the fingers' way of 2 mm and what is left of the object's 4 mm.
        let force = (2e-3 + share * 4e-3) / (1e-3 + 1.0 / 500.0);
        let held = grip.friction * 2.0 * force;
        assert!((held - GRIP_MARGIN * carried).abs() < 1e-12, "{held} N held of {carried} N");
    }

    #[test]
    fn nothing_can_be_spared_where_the_grip_just_holds_the_object() {
        assert_eq!(pinch(5.0, 0.0).share_left(), 1.0);
        assert_eq!(pinch(1.0, 1e-2).share_left(), 1.0);
    }

    #[test]
    fn forces_go_on_in_their_share() {
        let contact = HeldContact {
            body: 1,
            nodes: [1, 2, 3],
            weights: [0.5, 0.25, 0.25],
            force: [1.0, 2.0, 3.0],
        };
        let before = ObjectState {
            force_nodes: vec![4],
            forces: vec![[2.0, 0.0, -2.0]],
            contacts: vec![contact],
            velocity: [1.0; 3],
            ..ObjectState::at_rest([1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0])
        };
        let after = pressing_on(&before, 0.5);
        assert_eq!((after.pose, after.velocity), (before.pose, [0.0; 3]));
        assert_eq!(
            (after.forces, after.contacts[0].force),
            (vec![[1.0, 0.0, -1.0]], [0.5, 1.0, 1.5])
        );
        assert_eq!(pressing_on(&before, 0.0), ObjectState::at_rest(before.pose));
    }
}
