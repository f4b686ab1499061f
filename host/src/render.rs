//! Pictures of meshes.
