//! Virtual touches of objects, as many as wanted.
