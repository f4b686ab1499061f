//! Wavefront OBJ files, read and written.
