//! The place of an object on a table, and of an approach to it.

/// A place where an object's origin is on the table, how it is turned, and how sure that is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "link", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TablePose {
    /// The object's placement.
    pub placement: u8,
    /// Place of the placement's origin, in micrometers.
    pub position: [i32; 2],
    /// Turn about the vertical axis, in 1/65,536 turn.
    pub yaw: u16,
    /// Half of a 95 % interval of x, of y in micrometers.
    pub within: [u32; 2],
    /// Half of a 95 % interval of the yaw in 1/65,536 turn; none where the object is round.
    pub yaw_within: Option<u16>,
    /// Share of this mode among all cells of the object, in Q16.
    pub share: u32,
}

/// An approach straight down.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "link", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Approach {
    /// Place of the middle finger, in micrometers.
    pub x: i32,
    /// Place of the middle finger, in micrometers.
    pub y: i32,
    /// Direction of the row of fingers, in 1/256 turn from the x axis.
    pub roll: u8,
}
