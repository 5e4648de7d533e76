//! Loads that are spread over a body: weight, and pressure on its boundary.

use wincode::{SchemaRead, SchemaWrite};

use crate::limits::check_count;
use crate::payload::{PayloadReader, PayloadWriter, count_of};
use crate::{DecodeError, EncodeError, Limits};

/// Weight and pressure that act on a body beside its forces.
///
/// Units: `gravity` m/s², `densities` kg/m³. Frame: that of the mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SpreadLoads {
    /// Acceleration by which everything is drawn.
    pub gravity: [f64; 3],
    /// Density of the whole body, or one for each material, in the order of the materials; none where
    /// the body has no weight.
    pub densities: Vec<f64>,
    /// Even pressures on parts of the boundary; they add up.
    pub pressures: Vec<SurfacePressure>,
}

/// An even pressure on some triangles of the boundary.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfacePressure {
    /// Pressure against the outward normal at rest, Pa.
    pub pressure: f64,
    /// Nodes of the triangles, in any order.
    pub triangles: Vec<[u32; 3]>,
}

/// Announces the arrays of [`SpreadLoads`].
#[derive(Clone, Copy, Debug, Default, SchemaRead, SchemaWrite)]
pub(super) struct SpreadLoadsPart {
    gravity: [f64; 3],
    density_count: u32,
    pressure_count: u32,
    triangle_count: u32,
}

const DENSITIES: &str = "densities";
const PRESSURES: &str = "pressures";
const TRIANGLES: &str = "triangles under pressure";

impl SpreadLoads {
    /// Whether nothing acts.
    pub fn is_empty(&self) -> bool {
        self.densities.is_empty() && self.pressures.is_empty()
    }

    pub(super) fn part(&self) -> Result<SpreadLoadsPart, EncodeError> {
        let triangles = self.pressures.iter().map(|on| on.triangles.len()).sum();
        Ok(SpreadLoadsPart {
            gravity: self.gravity,
            density_count: count_of(DENSITIES, self.densities.len())?,
            pressure_count: count_of(PRESSURES, self.pressures.len())?,
            triangle_count: count_of(TRIANGLES, triangles)?,
        })
    }

    /// Writes the arrays: densities, pressures, numbers of triangles, triangles.
    pub(super) fn write_arrays(&self, writer: &mut PayloadWriter<'_>) {
        let pressures: Vec<f64> = self.pressures.iter().map(|on| on.pressure).collect();
        // All of them together are counted by 32 bits.
        let lens: Vec<u32> = self.pressures.iter().map(|on| on.triangles.len() as u32).collect();
        let triangles: Vec<[u32; 3]> =
            self.pressures.iter().flat_map(|on| on.triangles.iter().copied()).collect();
        writer.array(&self.densities);
        writer.array(&pressures);
        writer.array(&lens);
        writer.array(&triangles);
    }

    /// Reads the arrays that [`write_arrays`](Self::write_arrays) wrote; the counts have been checked.
    pub(super) fn read_arrays(
        reader: &mut PayloadReader<'_>,
        part: SpreadLoadsPart,
    ) -> Result<Self, DecodeError> {
        let SpreadLoadsPart { gravity, density_count, pressure_count, triangle_count } = part;
        let densities = reader.array(DENSITIES, density_count as usize)?;
        let of_pressures: Vec<f64> = reader.array(PRESSURES, pressure_count as usize)?;
        let lens: Vec<u32> = reader.array(PRESSURES, pressure_count as usize)?;
        let triangles: Vec<[u32; 3]> = reader.array(TRIANGLES, triangle_count as usize)?;
        let lens_sum = lens.iter().map(|&len| u64::from(len)).sum();
        if lens_sum != u64::from(triangle_count) {
            return Err(DecodeError::PressureLengths { lens_sum, triangle_count });
        }
        let mut left = triangles.as_slice();
        let pressures = of_pressures.into_iter().zip(lens).map(|(pressure, len)| {
            let (own, others) = left.split_at(len as usize);
            left = others;
            SurfacePressure { pressure, triangles: own.to_vec() }
        });
        let pressures = pressures.collect();
        Ok(Self { gravity, densities, pressures })
    }
}

impl SpreadLoadsPart {
    pub(super) fn check(&self, limits: &Limits) -> Result<(), DecodeError> {
        check_count(DENSITIES, self.density_count, limits.material_count_max)?;
        check_count(PRESSURES, self.pressure_count, limits.node_count_max)?;
        check_count(TRIANGLES, self.triangle_count, limits.tet_count_max)?;
        Ok(())
    }
}
