//! One attempt of the probe to touch a scene.
