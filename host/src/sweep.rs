//! First contact of a moving sphere with a triangle mesh.
