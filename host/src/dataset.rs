//! Touches on disk.
