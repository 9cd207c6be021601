//! The terrain backend of a flight simulator.
