//! From touches to an ensemble.
