//! The file of the forces.

use softgrasp_force::{Renderer, Target};

use crate::spring::{Spring, press_until};

#[test]
fn the_file_has_place_force_and_energy_of_every_tick_that_is_felt() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("force.csv");
    let renderer = Renderer::start(Target::Record { path: path.clone() }).unwrap();
    let spring = Spring { stiffness: 100.0, port: 2 };
    let mut looks = 0;
    press_until(spring, renderer.newest(), 4e-3, |height| {
        looks += u32::from(height == -4e-3);
        looks > 10
    });
    let report = renderer.finish();
    assert_eq!(report.device_failed, None);
    let text = std::fs::read_to_string(&path).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("time,finger,x,y,z,fx,fy,fz,energy"));
    let rows: Vec<Vec<f64>> =
        lines.map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect()).collect();
    assert!(rows.len() > 50, "{}", rows.len());
    assert!(rows.iter().all(|row| row.len() == 9 && row[1] == 2.0));
    let last = rows.iter().rfind(|row| row[6] > 0.0).unwrap();
    assert!((last[6] - 0.4).abs() < 1e-6 && (last[3] + 4e-3).abs() < 1e-9, "{last:?}");
    // The spring stores ½ k x².
    let stored = 0.5 * 100.0 * 4e-3 * 4e-3;
    assert!(last[8] > 0.9 * stored, "{last:?} {stored}");
}

#[test]
fn a_file_that_cannot_be_written_is_refused() {
    let refused = Renderer::start(Target::Record { path: "no/such/folder/f.csv".into() });
    assert!(refused.unwrap_err().to_string().contains("cannot be written"));
}
