//! The transforms of a node, in their order.

use super::numbers::numbers;
use super::{Wrong, damaged, unsupported, wrong};
use glam::{DAffine3, DMat4, DVec3};
use roxmltree::Node;

/// Transform of a node's content within its parent.
pub(super) fn of(node: Node<'_, '_>) -> Result<DAffine3, Wrong> {
    let mut whole = DAffine3::IDENTITY;
    for child in node.children().filter(Node::is_element) {
        let name = child.tag_name().name();
        whole *= match name {
            "translate" => DAffine3::from_translation(DVec3::from(exactly::<3>(child)?)),
            "scale" => DAffine3::from_scale(DVec3::from(exactly::<3>(child)?)),
            "rotate" => {
                let [x, y, z, degrees] = exactly(child)?;
                match DVec3::new(x, y, z).try_normalize() {
                    Some(axis) => rotation(axis, degrees),
                    None if degrees == 0.0 => DAffine3::IDENTITY,
                    None => return Err(wrong(child, damaged("a rotation about no axis".into()))),
                }
            }
            "matrix" => {
                // Row by row in the file.
                let matrix = DMat4::from_cols_array(&exactly(child)?).transpose();
                if matrix.row(3).to_array() != [0.0, 0.0, 0.0, 1.0] {
                    return Err(wrong(child, damaged("a matrix whose last row is not 0 0 0 1".into())));
                }
                DAffine3::from_mat4(matrix)
            }
            "skew" | "lookat" => {
                let instead = "Apply the transforms to the mesh, then export it";
                return Err(unsupported(child, format!("the transform <{name}>"), instead));
            }
            _ => continue,
        };
    }
    Ok(whole)
}

/// A rotation about an axis of length 1; exact for quarter turns about a coordinate axis.
fn rotation(axis: DVec3, degrees: f64) -> DAffine3 {
    let quarters = degrees / 90.0;
    let (sine, cosine) = if quarters == libm::trunc(quarters) {
        // Of at most 4 in either direction, so nothing is lost.
        match (quarters % 4.0) as i32 {
            1 | -3 => (1.0, 0.0),
            2 | -2 => (0.0, -1.0),
            3 | -1 => (-1.0, 0.0),
            _ => (0.0, 1.0),
        }
    } else {
        let radians = degrees.to_radians();
        (libm::sin(radians), libm::cos(radians))
    };
    let turned = |vector: DVec3| cosine * vector + sine * axis.cross(vector) + (1.0 - cosine) * axis.dot(vector) * axis;
    DAffine3::from_mat3(glam::DMat3::from_cols(turned(DVec3::X), turned(DVec3::Y), turned(DVec3::Z)))
}

/// Exactly this many finite numbers.
fn exactly<const N: usize>(node: Node<'_, '_>) -> Result<[f64; N], Wrong> {
    let found = numbers::<f64>(node)?;
    let count = found.len();
    found.try_into().map_err(|_| {
        wrong(node, damaged(format!("<{}> has {count} numbers, where {N} must stand", node.tag_name().name())))
    })
}
