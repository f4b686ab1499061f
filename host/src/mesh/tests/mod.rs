//! Meshes and files for the tests of all formats.

pub(super) mod samples;
