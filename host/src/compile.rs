//! From an ensemble to the bytes that the chip reads.
