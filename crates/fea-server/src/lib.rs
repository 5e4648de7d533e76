//! Finite element server of Softgrasp, as a library so that the client can embed it.
