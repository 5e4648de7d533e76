//! Random contact frames and their answers.

use proptest::collection::vec;
use proptest::prelude::*;
use softgrasp_protocol::*;

use crate::random_messages::{answer, number, point};

/// Strategy that draws any contact frame.
pub fn contact_frame() -> impl Strategy<Value = ContactFrame> {
    let deformation =
        prop::option::of(prop_oneof![Just(Deformation::Large), Just(Deformation::Auto)]);
    let law = prop_oneof![Just(LawName::NeoHookean), Just(LawName::NeoHookeanLog)];
    let equations = (deformation, law, any::<bool>());
    let ask = (prop::array::uniform5(number()), point(), any::<[u32; 2]>(), equations).prop_map(
        |(
            [seconds, density, viscosity, penetration_rel, residual_rel],
            gravity,
            [rounds, steps],
            (deformation, law, small_system),
        )| {
            ContactAsk {
                seconds,
                gravity,
                density,
                viscosity,
                penetration_rel,
                residual_rel,
                rounds_max: rounds,
                newton_max: steps,
                deformation,
                law,
                yield_stress: (rounds % 3 == 0).then_some(seconds),
                path: if steps % 2 == 0 { PathChoice::Continue } else { PathChoice::FromRest },
                small_system,
                deadline_ms: (rounds % 2 == 0).then_some(density),
            }
        },
    );
    let candidates = vec((any::<[u32; 3]>(), any::<u32>()), 0..6);
    let nodes =
        prop_oneof![Just(NodeChoice::All), vec(any::<u32>(), 0..6).prop_map(NodeChoice::Nodes)];
    let model = any::<[u8; 32]>().prop_map(ModelHash);
    (model, ask, object_state(), vec(body(), 0..5), candidates, nodes).prop_map(
        |(model, ask, state, bodies, candidates, nodes)| {
            let (triangles, triangle_bodies) = candidates.into_iter().unzip();
            let precision = Precision::F32Quantised;
            let fields = FieldSet::from_bits(ask.rounds_max);
            ContactFrame {
                model,
                ask,
                state,
                bodies,
                triangles,
                triangle_bodies,
                nodes,
                precision,
                fields,
            }
        },
    )
}

/// Strategy that draws any answer to a contact frame.
pub fn contact_answer() -> impl Strategy<Value = ContactAnswer> {
    let report = (prop::array::uniform5(number()), any::<bool>(), any::<[u32; 6]>()).prop_map(
        |(numbers, is_converged, counts)| {
            let [rounds, sweeps, newton_steps, columns_computed, shapes, factors] = counts;
            let [penetration_max, slip_max, residual, residual_rel, cone_violation] = numbers;
            ContactReport {
                penetration_max,
                slip_max,
                residual,
                residual_rel,
                cone_violation,
                is_converged,
                rounds,
                sweeps,
                newton_steps,
                columns_computed,
                is_large: shapes % 2 == 1,
                shapes,
                factors,
                plastic_strain: slip_max,
                small_contacts: 0,
                is_late: factors % 2 == 1,
            }
        },
    );
    let contact = (any::<u32>(), any::<bool>(), prop::array::uniform4(point())).prop_map(
        |(body, slips, [place, normal, force, slip])| ContactPoint {
            body,
            slips,
            place,
            normal,
            force,
            slip,
        },
    );
    let load = (point(), point(), number(), any::<u32>()).prop_map(
        |(force, torque, normal_force, contacts)| BodyLoad {
            force,
            torque,
            normal_force,
            contacts,
        },
    );
    (answer(), report, object_state(), vec(contact, 0..4), vec(load, 0..4), small_system())
        .prop_map(|(answer, contact, state, points, loads, small_system)| {
            let small_contacts = small_system.contacts.len() as u32;
            let contact = ContactReport { small_contacts, ..contact };
            // An answer to a contact frame has no derivatives.
            let answer = Answer { gradient: None, ..answer };
            ContactAnswer { answer, contact, state, points, loads, small_system }
        })
}

fn small_system() -> impl Strategy<Value = SmallSystem> {
    let contact = (any::<u32>(), prop::array::uniform3(point()), number()).prop_map(
        |(body, [place, normal, force], friction)| BodyContact {
            body,
            place,
            normal,
            force,
            friction,
        },
    );
    vec(contact, 0..4).prop_flat_map(|contacts| {
        let size = 9 * contacts.len() * contacts.len();
        vec(number(), size).prop_map(move |compliance| {
            let contacts = contacts.clone();
            SmallSystem { contacts, compliance }
        })
    })
}

fn object_state() -> impl Strategy<Value = ObjectState> {
    let held = (any::<u32>(), any::<[u32; 3]>(), point(), point())
        .prop_map(|(body, nodes, weights, force)| HeldContact { body, nodes, weights, force });
    let forces = vec((any::<u32>(), point()), 0..5);
    (pose(), point(), point(), forces, vec(held, 0..4)).prop_map(
        |(pose, velocity, angular_velocity, forces, contacts)| {
            let (force_nodes, forces) = forces.into_iter().unzip();
            ObjectState { pose, velocity, angular_velocity, force_nodes, forces, contacts }
        },
    )
}

fn body() -> impl Strategy<Value = BodyMotion> {
    let shape = prop_oneof![
        number().prop_map(|radius| BodyShape::Sphere { radius }),
        (number(), number()).prop_map(|(radius, length)| BodyShape::Capsule { radius, length }),
        point().prop_map(|normal| BodyShape::Plane { normal }),
        point().prop_map(|half| BodyShape::Box { half }),
        (point(), number()).prop_map(|(half, radius)| BodyShape::RoundedBox { half, radius }),
        (vec(point(), 0..5), vec(any::<[u32; 3]>(), 0..5))
            .prop_map(|(vertices, triangles)| BodyShape::Mesh { vertices, triangles }),
        (vec(point(), 0..5), vec(any::<[u32; 3]>(), 0..5), number()).prop_map(
            |(vertices, triangles, radius)| BodyShape::RoundedMesh { vertices, triangles, radius }
        ),
    ];
    (shape, pose(), pose(), number(), number()).prop_map(
        |(shape, start, end, friction, compliance)| BodyMotion {
            shape,
            start,
            end,
            friction,
            compliance,
        },
    )
}

fn pose() -> impl Strategy<Value = Pose> {
    prop::array::uniform7(number())
}
