//! Poses in bins: 26 directions, and a few rolls of the row of fingers about each.

use crate::touch::{Pose, Q15_ONE};

/// Directions of motion: from the center of a cube to its 8 corners, 12 edges and 6 faces.
pub const DIRECTIONS: u16 = 26;

/// Largest number of poses: four rolls for each direction.
pub const MOST_POSES: usize = 104;

/// A numbering of poses: 26 directions, each with one, two or four rolls.
///
/// Direction n is the n-th of the vectors (x, y, z) of −1, 0 and 1, without (0, 0, 0), in the order of x, then y, then z.
/// A roll is the angle from *across* to the row of fingers about the direction, modulo 180°, since a row that is turned
/// end to end is the same row. Across is (−y, x, 0), or (1, 0, 0) where that is zero; *along* is direction × across.
/// Roll r of R is the one nearest to r · 180° / R. Pose number = n · R + r.
///
/// ```
/// use palpate_shared::{Pose, Poses};
///
/// let poses = Poses::with_rolls(4).unwrap();
/// assert_eq!(poses.count(), 104);
/// // Straight down, with the row along x: direction 12, roll 0.
/// let down = Pose { direction: [0, 0, -32_767], alignment: [32_767, 0, 0] };
/// assert_eq!(poses.number_of(&down), 48);
/// assert_eq!(poses.pose(48), Some(down));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Poses {
    rolls: u8,
}

/// A vector of small whole numbers.
type Steps = [i32; 3];

impl Poses {
    /// With this many rolls for each direction: 1, where only the direction counts, 2 or 4; `None` for another number.
    pub const fn with_rolls(rolls: u8) -> Option<Self> {
        match rolls {
            1 | 2 | 4 => Some(Self { rolls }),
            _ => None,
        }
    }

    /// Rolls for each direction.
    pub const fn rolls(self) -> u8 {
        self.rolls
    }

    /// Number of poses: 26, 52 or 104.
    pub const fn count(self) -> u16 {
        DIRECTIONS * self.rolls as u16
    }

    /// The number of the pose that is nearest to this one: the nearest direction, then the nearest roll.
    ///
    /// Cost: a scalar product for each of 26 directions, and the roll; more on a chip without 64-bit products. Cannot fail.
    pub fn number_of(self, pose: &Pose) -> u16 {
        let mut best = (0, i32::MIN);
        for number in 0..DIRECTIONS {
            let steps = steps(number);
            // At most 3 · 2^15 · 2^15 / √3, below 2^31.
            let cosine = dot(steps, pose.direction) * reciprocal_root(dot(steps, steps.map(narrow)));
            if cosine > best.1 {
                best = (number, cosine);
            }
        }
        best.0 * u16::from(self.rolls) + self.roll(steps(best.0), pose.alignment)
    }

    /// The middle of the pose with this number: unit vectors in Q15. `None` if there is no such number.
    ///
    /// Cost: a few products and divisions. Cannot fail.
    pub fn pose(self, number: u16) -> Option<Pose> {
        if number >= self.count() {
            return None;
        }
        // Not zero: there is no such numbering.
        let rolls = u16::from(self.rolls).max(1);
        let steps = steps(number / rolls);
        let (across, along) = row(steps);
        let [u, v] = [unit(across), unit(along)];
        let zip = |sign: i32| {
            let [a, b, c] = u;
            let [x, y, z] = v;
            [(a, x), (b, y), (c, z)].map(|(u, v)| ((sign * u + v) * reciprocal_root(2)) >> 15)
        };
        // In steps of 45°.
        let alignment = match number % rolls * (4 / rolls) {
            0 => u,
            1 => zip(1),
            2 => v,
            _ => zip(-1),
        };
        Some(Pose { direction: unit(steps).map(narrow), alignment: alignment.map(narrow) })
    }

    /// The roll nearest to a row of fingers.
    fn roll(self, direction: Steps, alignment: [i16; 3]) -> u16 {
        if self.rolls == 1 {
            return 0;
        }
        let (across, along) = row(direction);
        // Along is as long as across times direction; so both components count in the same unit, Q10.
        let x = i64::from(dot(across, alignment)) * root_q10(dot(direction, direction.map(narrow)));
        let y = i64::from(dot(along, alignment)) << 10;
        // Below 2^28: cosine and sine of twice the angle, below 2^57.
        let (cosine, sine) = (x * x - y * y, 2 * x * y);
        match (self.rolls == 4 && cosine.abs() < sine.abs(), self.rolls) {
            (true, _) => 1 + 2 * u16::from(sine < 0),
            (false, 2) => u16::from(cosine < 0),
            (false, _) => 2 * u16::from(cosine < 0),
        }
    }
}

/// The direction with this number as steps of −1, 0 and 1.
fn steps(number: u16) -> Steps {
    // (0, 0, 0) would be number 13.
    let number = i32::from(number) + i32::from(number >= 13);
    [number / 9 - 1, number / 3 % 3 - 1, number % 3 - 1]
}

/// Across and along: what rolls about a direction count from and to.
fn row([x, y, z]: Steps) -> (Steps, Steps) {
    let across @ [a, b, _] = if x == 0 && y == 0 { [1, 0, 0] } else { [-y, x, 0] };
    (across, [-z * b, z * a, x * b - y * a])
}

fn dot([x, y, z]: Steps, [a, b, c]: [i16; 3]) -> i32 {
    x * i32::from(a) + y * i32::from(b) + z * i32::from(c)
}

/// The unit vector of these steps in Q15.
fn unit(steps: Steps) -> Steps {
    let factor = reciprocal_root(dot(steps, steps.map(narrow)));
    steps.map(|step| step * factor)
}

/// 1/√`square` in Q15, for the squares of vectors of steps.
fn reciprocal_root(square: i32) -> i32 {
    match square {
        1 => Q15_ONE.into(),
        2 => 23_170,
        3 => 18_918,
        4 => 16_384,
        _ => 13_377,
    }
}

/// √`square` in Q10, for the squares of directions.
fn root_q10(square: i32) -> i64 {
    match square {
        1 => 1_024,
        2 => 1_448,
        _ => 1_774,
    }
}

/// Narrows a number to 16 bits; one beyond them becomes `Q15_ONE`.
fn narrow(number: i32) -> i16 {
    i16::try_from(number).unwrap_or(Q15_ONE)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Poses; 3] = [Poses { rolls: 1 }, Poses { rolls: 2 }, Poses { rolls: 4 }];

    fn real(vector: [i16; 3]) -> [f64; 3] {
        vector.map(|cosine| f64::from(cosine) / 32_767.0)
    }

    fn product(a: [f64; 3], b: [f64; 3]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    #[test]
    fn the_middle_of_every_pose_has_its_number_and_is_made_of_perpendicular_unit_vectors() {
        for poses in ALL {
            for number in 0..poses.count() {
                let pose = poses.pose(number).unwrap();
                assert_eq!(poses.number_of(&pose), number, "{pose:?}");
                let reversed = Pose { alignment: pose.alignment.map(|cosine| -cosine), ..pose };
                assert_eq!(poses.number_of(&reversed), number, "{reversed:?}");
                let [direction, alignment] = [pose.direction, pose.alignment].map(real);
                for vector in [direction, alignment] {
                    assert!((product(vector, vector) - 1.0).abs() < 3e-4, "{pose:?}");
                }
                assert!(product(direction, alignment).abs() < 3e-4, "{pose:?}");
            }
            assert_eq!(poses.pose(poses.count()), None);
        }
        assert_eq!(ALL.map(Poses::count), [26, 52, 104]);
        assert!([0, 3, 5, 8, 255].iter().all(|&rolls| Poses::with_rolls(rolls).is_none()));
    }

    #[test]
    fn a_pose_belongs_to_the_nearest_direction_and_the_nearest_roll() {
        let mut state = 1_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / 2_f64.powi(30) - 1.0
        };
        let mut vector = || {
            let vector = [next(), next(), next()];
            let length = product(vector, vector).sqrt();
            vector.map(|cosine| (cosine / length * 32_767.0) as i16)
        };
        for _ in 0..20_000 {
            let pose = Pose { direction: vector(), alignment: vector() };
            for poses in ALL {
                let found = poses.pose(poses.number_of(&pose)).unwrap();
                let to = |other: Pose| product(real(other.direction), real(pose.direction));
                let row = |other: Pose| product(real(other.alignment), real(pose.alignment)).abs();
                for other in (0..poses.count()).filter_map(|number| poses.pose(number)) {
                    assert!(to(other) <= to(found) + 2e-4, "{pose:?}: {other:?}");
                    // Of the same direction: no row is nearer.
                    let same = other.direction == found.direction;
                    assert!(!same || row(other) <= row(found) + 2e-3, "{pose:?}: {other:?}");
                }
            }
        }
    }

    #[test]
    fn no_pose_overflows() {
        let edges = [i16::MIN, -1, 0, 1, i16::MAX];
        for a in edges {
            for b in edges {
                for c in edges {
                    for pose in [[a, b, c], [c, a, b]].map(|alignment| Pose { direction: [a, b, c], alignment }) {
                        assert!(ALL.iter().all(|poses| poses.number_of(&pose) < poses.count()));
                    }
                }
            }
        }
    }
}
