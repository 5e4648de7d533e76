//! Messages of Haply's service (3.x): JSON over a WebSocket, states in and forces out.
//!
//! The service's axes are x to the right, y away from the person, z up; the world's are x to the right,
//! y up, z towards the person.

use nalgebra::Vector3;
use serde_json::{Value, json};

/// A state of an Inverse3.
#[derive(Clone, Debug, PartialEq)]
pub struct HaplyState {
    /// Name of the device.
    pub device_id: String,
    /// Place of the cursor, m, world axes.
    pub place: Vector3<f64>,
}

/// A place outside of this distance from the device is no place of its cursor, m.
const REACH_MAX: f64 = 2.0;
/// Longest name of a device.
const NAME_LEN_MAX: usize = 64;

/// World axes from those of the service.
pub fn world_of(haply: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(haply.x, haply.z, -haply.y)
}

/// Axes of the service from those of the world.
pub fn haply_of(world: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(world.x, -world.z, world.y)
}

/// The state of the first Inverse3 in a message; `None` where it has none, or is no message.
pub fn state_of(text: &str) -> Option<HaplyState> {
    let message: Value = serde_json::from_str(text).ok()?;
    let device = message.get("inverse3")?.get(0)?;
    let device_id = device.get("device_id")?.as_str()?;
    let cursor = device.get("state")?.get("cursor_position")?;
    let number = |axis: &str| cursor.get(axis)?.as_f64().filter(|x| x.abs() < REACH_MAX);
    let place = Vector3::new(number("x")?, number("y")?, number("z")?);
    let is_name = !device_id.is_empty() && device_id.len() <= NAME_LEN_MAX;
    is_name.then(|| HaplyState { device_id: device_id.to_owned(), place: world_of(&place) })
}

/// The message that sets the force on the cursor, N, world axes.
///
/// Services from 3.5 on read the force from `vector`, older ones from `values`.
pub fn force_message(device_id: &str, force: &Vector3<f64>) -> String {
    let force = haply_of(force);
    let vector = json!({"x": force.x, "y": force.y, "z": force.z});
    json!({
        "inverse3": [{
            "device_id": device_id,
            "commands": {"set_cursor_force": {"vector": vector, "values": vector}},
        }],
    })
    .to_string()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn state_of_the_service_is_read() {
        let text = r#"{"inverse3":[{"device_id":"049D","state":{"cursor_position":
            {"x":0.01,"y":-0.12,"z":0.2},"cursor_velocity":{"x":0,"y":0,"z":0}}}],"verse_grip":[]}"#;
        let state = state_of(text).unwrap();
        assert_eq!(state.device_id, "049D");
        assert_eq!(state.place, Vector3::new(0.01, 0.2, 0.12));
        for wrong in ["", "{}", r#"{"inverse3":[]}"#, &text.replace("0.01", "1e400")] {
            assert_eq!(state_of(wrong), None, "{wrong}");
        }
        assert_eq!(state_of(&text.replace("0.01", "3.5")), None, "out of reach");
    }

    #[test]
    fn force_up_is_along_the_third_axis_of_the_service_in_newtons() {
        let text = force_message("049D", &Vector3::new(0.0, 1.5, -0.5));
        let message: Value = serde_json::from_str(&text).unwrap();
        let force = &message["inverse3"][0]["commands"]["set_cursor_force"]["vector"];
        assert_eq!(
            [&force["x"], &force["y"], &force["z"]].map(|v| v.as_f64()),
            [Some(0.0), Some(0.5), Some(1.5)]
        );
    }

    proptest! {
        #[test]
        fn any_text_is_read_or_passed_over(text in "\\PC{0,200}") {
            let _ = state_of(&text);
        }

        #[test]
        fn axes_go_there_and_back(v in prop::array::uniform3(-1.0..1.0f64)) {
            let v = Vector3::from(v);
            prop_assert_eq!(haply_of(&world_of(&v)), v);
            prop_assert!(world_of(&Vector3::x()).cross(&world_of(&Vector3::y())) == world_of(&Vector3::z()));
        }
    }
}
