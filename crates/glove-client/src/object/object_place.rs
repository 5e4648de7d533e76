//! Place of an object when a run begins: its home, or where the first hand closes.

/// Place where the object is put.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ObjectPlace {
    /// The object's home, the pose at which the run began.
    #[default]
    Home,
    /// Once, between thumb and fingers of the first hand that is measured, so that a hand whose place
    /// nobody chose need not look for the object.
    Hand,
}
