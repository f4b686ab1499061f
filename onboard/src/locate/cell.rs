//! Cells of (placement, yaw, x, y), and bounds on them.

use super::number::quotient;

/// Most touches that a locator has room for.
pub(super) const MOST_TOUCHES: usize = 64;
/// Root cells of yaw.
pub(super) const YAWS: u8 = 8;
/// Times that a root cell can be split: finest cells are of 0.9 mm and 2.8°.
pub(super) const FINEST: u8 = 4;

/// A cell: its likelihood, and what it is of.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cell {
    pub(super) placement: u8,
    pub(super) yaw: u8,
    pub(super) x: u8,
    pub(super) y: u8,
    pub(super) level: u8,
    /// Logarithm of its share, in 1/64 nat.
    pub(super) likely: i16,
}

impl Cell {
    /// No cell.
    pub(crate) const NONE: Self = Self { placement: 0, yaw: 0, x: 0, y: 0, level: 0, likely: 0 };
}

/// A place for cells.
pub trait Pool: AsRef<[Cell]> + AsMut<[Cell]> {}

impl<P: AsRef<[Cell]> + AsMut<[Cell]>> Pool for P {}

/// Roots of 0, 1, 2 and so on in Q4: of the number of moves since a touch.
pub(super) const ROOTS: [i32; MOST_TOUCHES] = {
    let (mut roots, mut number, mut root) = ([0; MOST_TOUCHES], 0, 0);
    while number < MOST_TOUCHES as i32 {
        while (root + 1) * (root + 1) <= number * 256 {
            root += 1;
        }
        roots[number as usize] = root;
        number += 1;
    }
    roots
};

/// Heights below this may be of the table after a contact was lost, in 1/16 mm.
pub(super) const NEAR: i32 = 24;

/// Middle of a cell's yaw, in 1/256 turn.
pub(super) fn turn(yaw: u8, level: u8) -> i32 {
    quotient((2 * i32::from(yaw) + 1) * 128, i32::from(YAWS) << level)
}
