//! An object scaled and centred, ready to be touched.
