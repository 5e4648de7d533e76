//! Partition and the methods that solve it.
