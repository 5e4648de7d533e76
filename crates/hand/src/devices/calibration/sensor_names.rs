//! The sensors' names in files and in sentences.

use crate::devices::cyberglove::Sensor;

/// Name in files, name in sentences, in the order of [`Sensor::ALL`].
const NAMES: [(&str, &str); 22] = [
    ("thumb_rotation", "thumb rotation"),
    ("thumb_mcp", "thumb MPJ"),
    ("thumb_ip", "thumb IJ"),
    ("thumb_abduction", "thumb abduction"),
    ("index_mcp", "index MPJ"),
    ("index_pip", "index PIJ"),
    ("index_dip", "index DIJ"),
    ("middle_mcp", "middle MPJ"),
    ("middle_pip", "middle PIJ"),
    ("middle_dip", "middle DIJ"),
    ("middle_index_abduction", "middle-index spread"),
    ("ring_mcp", "ring MPJ"),
    ("ring_pip", "ring PIJ"),
    ("ring_dip", "ring DIJ"),
    ("ring_middle_abduction", "ring-middle spread"),
    ("little_mcp", "little MPJ"),
    ("little_pip", "little PIJ"),
    ("little_dip", "little DIJ"),
    ("little_ring_abduction", "little-ring spread"),
    ("palm_arch", "palm arch"),
    ("wrist_pitch", "wrist pitch"),
    ("wrist_yaw", "wrist yaw"),
];

/// The name in files: that of the TOML form.
pub(super) fn file_name(sensor: Sensor) -> &'static str {
    NAMES[sensor.index()].0
}

/// The name for a person, for example `index MPJ`.
pub fn sensor_name(sensor: Sensor) -> &'static str {
    NAMES[sensor.index()].1
}

/// The sensor with this name in files.
pub(super) fn sensor_of_file_name(name: &str) -> Option<Sensor> {
    Sensor::ALL.into_iter().find(|&sensor| file_name(sensor) == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_in_files_are_those_of_the_toml_form() {
        for sensor in Sensor::ALL {
            let toml = serde_json::to_string(&sensor).unwrap();
            assert_eq!(toml.trim_matches('"'), file_name(sensor));
            assert_eq!(sensor_of_file_name(file_name(sensor)), Some(sensor));
        }
        assert_eq!(sensor_of_file_name("index MPJ"), None);
    }
}
