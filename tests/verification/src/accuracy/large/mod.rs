//! Large deformation: shapes followed from load to load, compared with closed forms and published values.

mod bend;
mod compressed_block;
mod cooks_membrane;
mod cylinder;
mod elastica;
mod followed;
mod homogeneous;
mod row;
mod section;
mod shear;
mod sphere;
mod torsion;
mod turned;

pub use section::add_to;
