//! Virtual coupling: softens a small system until no port is stiffer than its device can hold.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::small_system::SmallSystem;

/// A small system as it is rendered: its compliance with that of the coupling.
#[derive(Clone, Debug)]
pub struct Coupled {
    /// Compliance with the coupling, 3m × 3m, m/N.
    pub compliance: DMatrix<f64>,
    /// Displacement `C F_s` of the contacts by the forces of the answer, 3m, m: a softened system is
    /// without force where the true one is.
    pub pressed: DVector<f64>,
    /// Largest share of a port's stiffness that the coupling has taken; 0 where nothing was softened.
    pub softened: f64,
}

impl Coupled {
    /// A system none of whose ports is stiffer than `stiffness_max`, N/m.
    ///
    /// The stiffness of the ports with the other bodies at rest is `K = C̄⁻¹`, C̄ being the Schur complement
    /// of C. A port with n contacts moves them all, so that n·K counts. Eigenvalues of C̄ that are too
    /// small are raised, and no others: where the object is soft enough nothing changes.
    pub fn new(system: &SmallSystem, stiffness_max: f64) -> Self {
        let compliance = system.compliance().clone();
        let pressed = &compliance * system.forces();
        let plain = Self { compliance, pressed, softened: 0.0 };
        let moved = rows_where(system, true);
        if moved.is_empty() || !stiffness_max.is_finite() {
            return plain;
        }
        let scale = scales(system, &moved);
        let seen = seen_by_ports(&plain.compliance, &moved, &rows_where(system, false));
        let scaled =
            DMatrix::from_fn(moved.len(), moved.len(), |r, c| seen[(r, c)] / (scale[r] * scale[c]));
        let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(scaled);
        let least = 1.0 / stiffness_max;
        let added = eigenvalues.map(|c| (least - c).max(0.0));
        if added.iter().all(|c| *c == 0.0) {
            return plain;
        }
        let softest = eigenvalues.iter().fold(f64::INFINITY, |low, c| low.min(*c));
        let added = &eigenvectors * DMatrix::from_diagonal(&added) * eigenvectors.transpose();
        let mut compliance = plain.compliance;
        for (r, &row) in moved.iter().enumerate() {
            for (c, &column) in moved.iter().enumerate() {
                let share = 0.5 * (added[(r, c)] + added[(c, r)]);
                compliance[(row, column)] += scale[r] * scale[c] * share;
            }
        }
        Self { compliance, softened: 1.0 - softest.max(0.0) / least, ..plain }
    }
}

/// Rows of the contacts that a port moves, or of the others.
fn rows_where(system: &SmallSystem, is_moved: bool) -> Vec<usize> {
    let contacts = system.contacts().iter().enumerate();
    let chosen = contacts.filter(|(_, contact)| contact.port.is_some() == is_moved);
    chosen.flat_map(|(i, _)| 3 * i..3 * i + 3).collect()
}

/// Root of the number of contacts that share a row's port.
fn scales(system: &SmallSystem, moved: &[usize]) -> Vec<f64> {
    let contacts = system.contacts();
    let of_row = |row: &usize| {
        let port = contacts[row / 3].port;
        (contacts.iter().filter(|contact| contact.port == port).count() as f64).sqrt()
    };
    moved.iter().map(of_row).collect()
}

/// Compliance of some rows while the places of the others stay.
fn seen_by_ports(compliance: &DMatrix<f64>, moved: &[usize], still: &[usize]) -> DMatrix<f64> {
    let block = |rows: &[usize], columns: &[usize]| {
        DMatrix::from_fn(rows.len(), columns.len(), |r, c| compliance[(rows[r], columns[c])])
    };
    let own = block(moved, moved);
    if still.is_empty() {
        return own;
    }
    let across = block(moved, still);
    match block(still, still).cholesky() {
        Some(factor) => own - &across * factor.solve(&across.transpose()),
        None => own,
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};
    use proptest::prelude::*;

    use super::*;
    use crate::small_system::SmallContact;

    fn system(ports: &[Option<usize>], numbers: &[f64]) -> SmallSystem {
        let rows = 3 * ports.len();
        let a = DMatrix::from_fn(rows, rows, |r, c| numbers[(r * rows + c) % numbers.len()]);
        let compliance = 1e-3 * (&a * a.transpose() + 0.05 * DMatrix::identity(rows, rows));
        let contact = |(i, &port): (usize, &Option<usize>)| SmallContact {
            body: i as u32,
            port,
            place_in_body: Point3::origin(),
            place: Point3::origin(),
            normal: Vector3::z(),
            force: Vector3::new(0.1, 0.0, 1.0),
            friction: 0.5,
        };
        let contacts = ports.iter().enumerate().map(contact).collect();
        SmallSystem::try_new(contacts, compliance).unwrap()
    }

    /// Stiffness of one port that moves all of its contacts alike, the others at rest.
    fn stiffness_of(coupled: &Coupled, system: &SmallSystem, port: usize) -> f64 {
        let stiffness = coupled.compliance.clone().try_inverse().unwrap();
        let of_port: Vec<usize> = (0..system.contacts().len())
            .filter(|&i| system.contacts()[i].port == Some(port))
            .collect();
        let mut sum = nalgebra::Matrix3::zeros();
        for &i in &of_port {
            for &j in &of_port {
                sum += stiffness.fixed_view::<3, 3>(3 * i, 3 * j);
            }
        }
        sum.symmetric_eigenvalues().max()
    }

    proptest! {
        #[test]
        fn no_port_is_stiffer_than_its_device_holds(
            numbers in prop::collection::vec(-1.0..1.0f64, 90),
            stiffness in 10.0..3000.0f64,
        ) {
            let system = system(&[None, Some(0), Some(0), Some(1)], &numbers);
            let coupled = Coupled::new(&system, stiffness);
            for port in 0..2 {
                let found = stiffness_of(&coupled, &system, port);
                prop_assert!(found <= stiffness * (1.0 + 1e-6), "{found} {stiffness}");
            }
            // It only ever softens.
            let added = &coupled.compliance - system.compliance();
            let least = added.symmetric_eigenvalues().min();
            prop_assert!(least > -1e-12, "{least:e}");
        }
    }

    #[test]
    fn soft_system_is_left_as_it_is() {
        let system = system(&[None, Some(0)], &[0.3, -0.1, 0.7, 0.2, 0.5]);
        let stiff = Coupled::new(&system, 1e9);
        assert_eq!(stiff.compliance, *system.compliance());
        assert_eq!(stiff.softened, 0.0);
        assert!(Coupled::new(&system, 1.0).softened > 0.5);
    }
}
