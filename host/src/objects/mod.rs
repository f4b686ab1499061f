//! The ten built-in objects, made from implicit functions.
