//! Where objects come from: built in, an OBJ file, a directory of them.
