//! The hand: joints, dimensions, kinematics and the colliders made from them.
