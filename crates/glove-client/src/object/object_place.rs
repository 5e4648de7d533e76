//! Where an object is put when a run begins: at its home, or where the first hand closes.

/// Where the object is put.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ObjectPlace {
    /// At its home.
    #[default]
    Home,
    /// Once, between thumb and fingers of the first hand that is heard of: a hand whose place nobody
    /// chose need not look for it.
    Hand,
}
