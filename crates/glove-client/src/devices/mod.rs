//! Instrumented glove and tracker: device bytes ⇄ samples, without I/O.
