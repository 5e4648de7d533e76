//! Bytes ⇄ messages of the Softgrasp wire, without I/O.
