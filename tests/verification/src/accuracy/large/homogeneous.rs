//! A cube with the same stretch everywhere: pulled along one axis or two, its other faces free.

use nalgebra::Point3;
use softgrasp_core::fem::hyperelastic::Law;
use softgrasp_core::fem::{Element, Material};

use super::followed::{Followed, nearest};
use super::row::Row;
use crate::accuracy::block::{block, shaken};
use crate::accuracy::discrete::Discrete;
use softgrasp_bench::report::ReportError;

/// Axes along which the cube is stretched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stretched {
    /// Stretched along x.
    Uniaxial,
    /// Stretched equally along x and y.
    Equibiaxial,
}

impl Stretched {
    const fn axes(self) -> usize {
        match self {
            Self::Uniaxial => 1,
            Self::Equibiaxial => 2,
        }
    }

    const fn name(self) -> &'static str {
        match self {
            Self::Uniaxial => "uniaxial",
            Self::Equibiaxial => "equibiaxial",
        }
    }

    const fn stretches(self) -> &'static [f64] {
        match self {
            Self::Uniaxial => &[0.84, 0.5, 2.0],
            Self::Equibiaxial => &[1.5],
        }
    }

    /// Nominal stress for E = 1, and the stretch of the free axes, along which there is none.
    ///
    /// Source: `P = μ (F − F⁻ᵀ) + λ ln J F⁻ᵀ`, the slope of the energy that is split by logarithms.
    fn state(self, stretch: f64, poisson: f64) -> Result<(f64, f64), ReportError> {
        let material = Material::try_new(1.0, poisson)?;
        let (mu, lambda) = (material.shear_modulus(), material.lame_lambda());
        let axes = self.axes() as f64;
        let stress = |along: f64, free: f64| {
            let log_volume = axes * stretch.ln() + (3.0 - axes) * free.ln();
            mu * (along - 1.0 / along) + lambda * log_volume / along
        };
        let (mut low, mut high) = (0.1, 10.0);
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            let is_pressed = stress(middle, middle) < 0.0;
            (low, high) = if is_pressed { (middle, high) } else { (low, middle) };
        }
        Ok((stress(stretch, low), low))
    }
}

/// Nominal stress and stretch of the free axes of an eighth of a cube with an irregular inside, held
/// by its planes of symmetry, each from rest.
///
/// # Errors
/// [`ReportError`].
pub fn stretched(
    how: Stretched,
    element: Element,
    poisson: f64,
    cells: usize,
) -> Result<Vec<Row>, ReportError> {
    let mesh = shaken(&block([cells; 3], Point3::from)?, 0.15 / cells as f64)?;
    let discrete = Discrete::new(&mesh, element, 1.0, poisson)?;
    let given = |stretch: f64| {
        let planes = (0..3).flat_map(|axis| discrete.give(axis, 0.0, |p| p[axis] == 0.0));
        let end = |axis| discrete.give(axis, stretch - 1.0, |p| p[axis] == 1.0);
        planes.chain((0..how.axes()).flat_map(end)).collect::<Vec<_>>()
    };
    let corner = nearest(discrete.nodes(), &Point3::new(1.0, 1.0, 1.0));
    let mut rows = Vec::new();
    for &stretch in how.stretches() {
        let (stress, free) = how.state(stretch, poisson)?;
        let about = (how.name(), poisson, cells);
        let mut body = Followed::new(&discrete, Law::NeoHookeanLog, &given(1.0), about)?;
        let end = body.follow(1, |_| (given(stretch), Vec::new()))?;
        let figures = [
            ("nominal stress", body.force_on(|p| p.x == 1.0).x, stress),
            ("free stretch", 1.0 + body.at(corner).z, free),
        ];
        rows.extend(body.rows(stretch, &end, &figures));
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::ELEMENTS;
    use crate::accuracy::outcome::ROUNDING;

    /// Six digits each, from integration apart from this code.
    #[test]
    fn closed_form_has_the_published_digits() {
        for (how, poisson, stretch, stress, free) in [
            (Stretched::Uniaxial, 0.3, 0.5, -0.935352, Some(1.210767)),
            (Stretched::Uniaxial, 0.3, 0.84, -0.184190, Some(1.052554)),
            (Stretched::Uniaxial, 0.3, 2.0, 0.646745, Some(0.798078)),
            (Stretched::Uniaxial, 0.49, 0.5, -1.148424, None),
            (Stretched::Uniaxial, 0.49, 0.84, -0.191901, None),
            (Stretched::Uniaxial, 0.49, 2.0, 0.586397, None),
            (Stretched::Equibiaxial, 0.3, 1.5, 0.467916, None),
            (Stretched::Equibiaxial, 0.49, 1.5, 0.457706, None),
        ] {
            let state = how.state(stretch, poisson).unwrap();
            assert!((state.0 - stress).abs() < 6e-7, "{how:?} {poisson} {stretch}: {state:?}");
            assert!(free.is_none_or(|free| (state.1 - free).abs() < 6e-7), "{state:?}");
        }
    }

    #[test]
    fn every_element_holds_homogeneous_stretch() {
        for &element in ELEMENTS {
            for how in [Stretched::Uniaxial, Stretched::Equibiaxial] {
                for poisson in [0.3, 0.49] {
                    let rows = stretched(how, element, poisson, 2).unwrap();
                    assert_eq!(rows.len(), 2 * how.stretches().len());
                    for row in rows {
                        assert!(row.outcome.error_rel < ROUNDING, "{row:?}");
                    }
                }
            }
        }
    }
}
