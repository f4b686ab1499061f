//! Objects of several meshes, for tests of the crates above.

use palpate::mesh::{Instance, Mesh, Object};

/// Three objects of two meshes each.
pub(crate) fn meshes() -> Vec<Object> {
    let sides = [
        ("one", [[1.0, 1.0, 1.0], [1.0, 0.6, 0.7]]),
        ("three", [[1.0, 0.9, 0.1], [1.0, 0.5, 0.12]]),
        ("two", [[1.0, 0.1, 0.1], [1.0, 0.35, 0.25]]),
    ];
    let object = |(name, sides): (&str, [[f32; 3]; 2])| {
        let instance = |(number, sides): (usize, [f32; 3])| Instance {
            name: format!("{name} {number}"),
            mesh: Mesh::globe(10).stretched(sides),
        };
        Object::of_instances(name, sides.into_iter().enumerate().map(instance).collect()).unwrap()
    };
    sides.map(object).into()
}
