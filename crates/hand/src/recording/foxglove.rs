//! Messages in the well-known JSON schemas of Foxglove, so that its programs draw hand and object without
//! being taught: `foxglove.FrameTransforms`, `foxglove.SceneUpdate` and `foxglove.Log`.
//!
//! Source: the schemas at docs.foxglove.dev/docs/sdk/schemas.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use serde_json::{Value, json};
use softgrasp_grasp::hand::{Finger, HandDimensions};

use super::tick::{HandSeen, SurfaceSeen};
use crate::sent::WhichHand;

/// Names of the three segments of a finger, from the palm outward.
const SEGMENTS: [&str; 3] = ["proximal", "middle", "distal"];
/// Colours of hand and object: red, green, blue, opacity.
const SKIN: [f64; 4] = [0.85, 0.67, 0.55, 1.0];
const OBJECT: [f64; 4] = [0.80, 0.20, 0.22, 1.0];
/// Level `INFO` of a line of the log.
const INFO: u8 = 2;
/// Half the thickness of the palm that is drawn, over the breadth of the hand.
const PALM_THICKNESS_SHARE: f64 = 0.26;

/// Where palms, segments and object are: frames `palm`, `object` and `index/proximal` and so on in `world`,
/// those of a second hand with `second/` before them.
///
/// Units: `at_s` s on the client's clock; m.
pub fn frame_transforms(
    hands: &[Option<HandSeen>; 2],
    world_from_object: &Isometry3<f64>,
    at_s: f64,
) -> Value {
    let hands = WhichHand::ALL.into_iter().zip(hands);
    let of_hands = hands.filter_map(|(which, hand)| Some((which, hand.as_ref()?)));
    let of_hands = of_hands.flat_map(|(which, hand)| {
        let palm = (palm_of(which), hand.world_from_palm);
        let of_fingers = Finger::ALL.into_iter().flat_map(move |finger| {
            let segments = &hand.world_from_segments[finger.index()];
            (0..3).map(move |segment| (frame_of(which, finger, segment), segments[segment]))
        });
        std::iter::once(palm).chain(of_fingers)
    });
    let frames = std::iter::once(("object".to_owned(), *world_from_object)).chain(of_hands);
    let transforms = frames.map(|(child, world_from_child)| {
        json!({
            "timestamp": time(at_s),
            "parent_frame_id": "world",
            "child_frame_id": child,
            "translation": xyz(&world_from_child.translation.vector),
            "rotation": xyzw(&world_from_child.rotation),
        })
    });
    json!({"transforms": transforms.collect::<Vec<_>>()})
}

/// The hand: a cylinder in the frame of each segment, and a box in that of the palm. Frames move them; they
/// are written again only when the size of the hand changes.
pub fn hand_scene(which: WhichHand, dimensions: &HandDimensions, at_s: f64) -> Value {
    let (lengths, radii) = (dimensions.segment_lengths(), dimensions.segment_radii());
    let tip_radii = dimensions.tip_radii();
    let of_fingers = Finger::ALL.into_iter().flat_map(|finger| {
        let (lengths, [a, b, c]) = (lengths[finger.index()], radii[finger.index()]);
        let radii = [a, b, c, tip_radii[finger.index()]];
        (0..3).map(move |segment| {
            let (length, radius) = (lengths[segment], radii[segment]);
            let end_scale = if radius > 0.0 { radii[segment + 1] / radius } else { 1.0 };
            // A cylinder stands along z, a bone lies along +Y of its segment.
            let turn =
                UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -std::f64::consts::FRAC_PI_2);
            let middle = Vector3::new(0.0, 0.5 * length, 0.0);
            let cylinder = json!({
                "pose": pose(&middle, &turn),
                "size": {"x": 2.0 * radius, "y": 2.0 * radius, "z": length},
                "bottom_scale": 1.0,
                "top_scale": end_scale.clamp(0.0, 1.0),
                "color": rgba(SKIN),
            });
            let frame = frame_of(which, finger, segment);
            entity(&frame, at_s, "cylinders", vec![cylinder])
        })
    });
    let (length, breadth) = (0.5 * dimensions.hand_length, dimensions.hand_breadth);
    let palm = json!({
        "pose": pose(&Vector3::new(0.0, 0.5 * length, 0.0), &UnitQuaternion::identity()),
        "size": {"x": breadth, "y": length, "z": PALM_THICKNESS_SHARE * breadth},
        "color": rgba(SKIN),
    });
    let palm = entity(&palm_of(which), at_s, "cubes", vec![palm]);
    json!({"deletions": [], "entities": std::iter::once(palm).chain(of_fingers).collect::<Vec<_>>()})
}

/// The deformed surface of the object, in the object's frame.
pub fn object_scene(surface: &SurfaceSeen, at_s: f64) -> Value {
    let triangles = json!({
        "pose": pose(&Vector3::zeros(), &UnitQuaternion::identity()),
        "points": surface.points.iter().map(point).collect::<Vec<_>>(),
        "color": rgba(OBJECT),
        "colors": [],
        "indices": surface.triangles.as_flattened(),
    });
    json!({"deletions": [], "entities": [entity("object", at_s, "triangles", vec![triangles])]})
}

/// A line of the log.
pub fn log_line(kind: &str, what: &str, at_s: f64) -> Value {
    json!({
        "timestamp": time(at_s), "level": INFO, "message": what, "name": kind, "file": "", "line": 0,
    })
}

/// JSON Schema of a message of one of these kinds, with the fields that are written here.
pub fn schema(name: &str) -> Value {
    let number = json!({"type": "number"});
    let integer = json!({"type": "integer"});
    let text = json!({"type": "string"});
    let object = |properties: Value| json!({"type": "object", "properties": properties});
    let list = |of: Value| json!({"type": "array", "items": of});
    let time = object(json!({"sec": integer, "nsec": integer}));
    let vector = object(json!({"x": number, "y": number, "z": number}));
    let turn = object(json!({"x": number, "y": number, "z": number, "w": number}));
    let pose = object(json!({"position": vector, "orientation": turn}));
    let color = object(json!({"r": number, "g": number, "b": number, "a": number}));
    let properties = match name {
        TRANSFORMS => json!({"transforms": list(object(json!({
            "timestamp": time, "parent_frame_id": text, "child_frame_id": text,
            "translation": vector, "rotation": turn,
        })))}),
        SCENE => {
            let cube = object(json!({"pose": pose, "size": vector, "color": color}));
            let cylinder = object(json!({
                "pose": pose, "size": vector, "bottom_scale": number, "top_scale": number,
                "color": color,
            }));
            let triangles = object(json!({
                "pose": pose, "points": list(vector.clone()), "color": color,
                "colors": list(color.clone()), "indices": list(integer.clone()),
            }));
            let others = list(object(json!({})));
            let entity = object(json!({
                "timestamp": time, "frame_id": text, "id": text, "lifetime": time,
                "frame_locked": {"type": "boolean"}, "metadata": others, "arrows": others,
                "cubes": list(cube), "spheres": others, "cylinders": list(cylinder),
                "lines": others, "triangles": list(triangles), "texts": others, "models": others,
            }));
            json!({"deletions": others, "entities": list(entity)})
        }
        _ => json!({
            "timestamp": time, "level": integer, "message": text, "name": text, "file": text,
            "line": integer,
        }),
    };
    json!({"type": "object", "title": name, "properties": properties})
}

/// Name of the schema of [`frame_transforms`].
pub const TRANSFORMS: &str = "foxglove.FrameTransforms";
/// Name of the schema of [`hand_scene`] and [`object_scene`].
pub const SCENE: &str = "foxglove.SceneUpdate";
/// Name of the schema of [`log_line`].
pub const LOG: &str = "foxglove.Log";

/// Beginning of the names of a hand's frames.
const fn prefix_of(which: WhichHand) -> &'static str {
    match which {
        WhichHand::First => "",
        WhichHand::Second => "second/",
    }
}

fn palm_of(which: WhichHand) -> String {
    format!("{}palm", prefix_of(which))
}

fn frame_of(which: WhichHand, finger: Finger, segment: usize) -> String {
    format!("{}{finger}/{}", prefix_of(which), SEGMENTS[segment])
}

/// An entity that moves with its frame, of primitives of one kind.
fn entity(frame: &str, at_s: f64, kind: &str, primitives: Vec<Value>) -> Value {
    let mut entity = json!({
        "timestamp": time(at_s), "frame_id": frame, "id": frame, "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": true, "metadata": [], "arrows": [], "cubes": [], "spheres": [],
        "cylinders": [], "lines": [], "triangles": [], "texts": [], "models": [],
    });
    entity[kind] = Value::from(primitives);
    entity
}

fn time(at_s: f64) -> Value {
    let nanoseconds = (at_s.max(0.0) * 1e9) as u64;
    json!({"sec": nanoseconds / 1_000_000_000, "nsec": nanoseconds % 1_000_000_000})
}

fn pose(place: &Vector3<f64>, turn: &UnitQuaternion<f64>) -> Value {
    json!({"position": xyz(place), "orientation": xyzw(turn)})
}

fn xyz(vector: &Vector3<f64>) -> Value {
    json!({"x": vector.x, "y": vector.y, "z": vector.z})
}

/// A point to a micrometre: a surface has many.
fn point(point: &Point3<f64>) -> Value {
    let rounded = point.coords.map(|c| (1e6 * c).round() / 1e6);
    xyz(&rounded)
}

fn xyzw(turn: &UnitQuaternion<f64>) -> Value {
    json!({"x": turn.i, "y": turn.j, "z": turn.k, "w": turn.w})
}

fn rgba([r, g, b, a]: [f64; 4]) -> Value {
    json!({"r": r, "g": g, "b": b, "a": a})
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_field_that_is_written_stands_in_the_schema() {
        let dimensions = HandDimensions::default();
        let hand = HandSeen {
            world_from_palm: Isometry3::identity(),
            world_from_segments: [[Isometry3::identity(); 3]; 5],
            angles_rad: [0.0; 23],
            dimensions,
        };
        let object = Isometry3::identity();
        let surface = SurfaceSeen { points: vec![Point3::origin(); 3], triangles: vec![[0, 1, 2]] };
        let messages = [
            (TRANSFORMS, frame_transforms(&[Some(hand.clone()), Some(hand)], &object, 1.5)),
            (SCENE, hand_scene(WhichHand::Second, &dimensions, 1.5)),
            (SCENE, object_scene(&surface, 1.5)),
            (LOG, log_line("grasp", "released", 1.5)),
        ];
        for (name, message) in &messages {
            check(name, &schema(name), message);
        }
        let frames = messages[0].1["transforms"].as_array().unwrap().iter();
        let names: Vec<&str> = frames.map(|f| f["child_frame_id"].as_str().unwrap()).collect();
        assert_eq!(names.len(), 1 + 2 * 16);
        for name in ["object", "palm", "second/palm", "index/distal", "second/thumb/proximal"] {
            assert!(names.contains(&name), "{name} in {names:?}");
        }
        assert_eq!(messages[1].1["entities"].as_array().unwrap().len(), 16);
        assert_eq!(messages[3].1["timestamp"], json!({"sec": 1, "nsec": 500_000_000}));
    }

    /// Every field of a message is one of the schema, of its type.
    fn check(at: &str, schema: &Value, message: &Value) {
        match message {
            Value::Object(fields) => {
                assert_eq!(schema["type"], "object", "{at}");
                for (name, value) in fields {
                    check(&format!("{at}.{name}"), &schema["properties"][name], value);
                }
            }
            Value::Array(items) => {
                assert_eq!(schema["type"], "array", "{at}");
                items.iter().for_each(|item| check(at, &schema["items"], item));
            }
            Value::Number(number) if number.is_f64() => {
                assert_eq!(schema["type"], "number", "{at}")
            }
            Value::Number(_) => assert!(schema["type"] != "string" && !schema.is_null(), "{at}"),
            Value::String(_) => assert_eq!(schema["type"], "string", "{at}"),
            Value::Bool(_) => assert_eq!(schema["type"], "boolean", "{at}"),
            Value::Null => panic!("{at} is null"),
        }
    }
}
