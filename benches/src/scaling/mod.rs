//! Report `scaling`: Figures 5.1, 5.2 and 6.13 to 6.16 of the thesis, measured again.

mod figures;
mod grid;
mod procedures;
mod report;

pub use report::measure;
