//! The functions that the page calls.

use crate::table::{Table, with};
use palpate::glam::DVec3;

/// Exports functions under their own names.
macro_rules! export {
    ($($(#[$meta:meta])* fn $name:ident($($argument:ident: $kind:ty),*) -> $result:ty $body:block)*) => {
        $(
            $(#[$meta])*
            // The names are this module's alone: nothing else is linked into it.
            #[allow(unsafe_code)]
            #[unsafe(no_mangle)]
            extern "C" fn $name($($argument: $kind),*) -> $result $body
        )*
    };
}

/// A number that fits, or −1.
fn number(found: Option<usize>) -> i32 {
    found.and_then(|number| i32::try_from(number).ok()).unwrap_or(-1)
}

export! {
    /// Makes room for `length` bytes of input, which the caller writes there.
    fn input(length: u32) -> *mut u8 {
        with(|table| table.room(length))
    }

    /// Buffer for numbers that go out.
    fn output() -> *const f64 {
        with(|table| table.output.as_ptr())
    }

    /// Begins with an empty game. `millimeters`: whether objects are touched at their true size; `aim`: 0 box, 1 middle,
    /// 2 mass; `stroke` and `travel`: 0 for none.
    fn start(millimeters: u32, aim: u32, radius: f64, spacing: f64, speed: f64, tilt: f64, stroke: f64, travel: f64) -> i32 {
        with(|table| number(table.start(millimeters != 0, aim, [radius, spacing, speed, tilt, stroke, travel])))
    }

    /// Adds the object of the input, its name (`name` bytes) and its packed mesh, with this longest side. Returns its number.
    fn add_object(name: u32, length: f64) -> i32 {
        with(|table| number(table.add_object(name, length)))
    }

    /// Puts the vertices of an object out, each 3 numbers in units. Returns how many numbers.
    fn vertices(object: u32) -> i32 {
        with(|table| number(table.vertices(object)))
    }

    /// Puts the triangles of an object out, each 3 vertices' numbers. Returns how many numbers.
    fn triangles(object: u32) -> i32 {
        with(|table| number(table.triangles(object)))
    }

    /// Adds the model of the input, which is compressed. Returns its number.
    fn add_model() -> i32 {
        with(|table| number(table.add_model()))
    }

    /// Sets the noise of touches to come: the input's 13 numbers (f64), in the order of the fields of `Noise`.
    fn set_noise() -> i32 {
        with(|table| number(table.set_noise()))
    }

    /// Begins to touch an object.
    fn begin(object: u32, seed: u32) -> i32 {
        with(|table| number(table.begin(object, seed)))
    }

    /// An approach at random: see [`Table::put_approach`](crate::table::Table).
    fn touch_at_random() -> i32 {
        with(|table| number(table.touch(|game, round| Some(game.touch_at_random(round)))))
    }

    /// An approach in the pose that the plan of a model proposes.
    fn touch_as_planned(model: u32) -> i32 {
        with(|table| number(table.touch(|game, round| game.touch_as_planned(round, usize::try_from(model).ok()?))))
    }

    /// An approach along a line through a point, rolled by an angle; −1 and nothing else if its middle finger misses.
    fn touch_along(x: f64, y: f64, z: f64, dx: f64, dy: f64, dz: f64, roll: f64) -> i32 {
        let (point, direction) = (DVec3::new(x, y, z), DVec3::new(dx, dy, dz));
        with(|table| number(table.touch(|game, round| game.touch_along(round, point, direction, roll))))
    }

    /// Puts out what a model knows: verdict (0 undecided, 1 recognized, 2 unknown, 3 gave up), the best object, approaches,
    /// touches that were evidence, why the last approach was none (0 it was), then each object's posterior, then each
    /// object's threshold. Returns how many objects the model has.
    fn player(model: u32) -> i32 {
        with(|table| number(table.player(model)))
    }

    /// The evidence of a model for each object, in its units.
    fn evidence(model: u32) -> *const i64 {
        with(|table: &mut Table| table.evidence(model))
    }

    /// Puts out the approach that a model's plan proposes: its pose's number, its score from 0 to 1, direction, alignment.
    fn propose(model: u32) -> i32 {
        with(|table| number(table.propose(model)))
    }

    /// Lays an object on the table: a placement of this weight, its rotation (9 numbers, column by column) and name in the input.
    /// Puts the vertices out as they lie about the placement's origin, in millimeters. Returns how many numbers.
    fn lay(object: u32, weight: f64) -> i32 {
        with(|table| number(table.lay(object, weight)))
    }

    /// Opens the maps of the input, which are compressed, for the objects that were laid on the table, all of them in their order.
    /// The noise: of heights and of the position in millimeters, the share of lost contacts, and drift in millimeters and degrees.
    fn open_maps(height: f64, position: f64, lost: f64, drift: f64, turn: f64) -> i32 {
        with(|table| number(table.open_maps([height, position, lost, drift, turn])))
    }

    /// Hides an object at a place that the seed determines.
    fn hide(object: u32, seed: u32) -> i32 {
        with(|table| number(table.hide(object, seed)))
    }

    /// Puts out the approach that tells most: x and y in millimeters, and the roll in 1/256 turn.
    fn choose() -> i32 {
        with(|table| number(table.choose()))
    }

    /// Presses straight down, at a place in millimeters with a roll in 1/256 turn. Puts out the height of each finger's contact, NaN
    /// for one that met nothing, and how low the hand went; −1 and nothing else if there is no room for another touch.
    fn press(x: f64, y: f64, roll: u32) -> i32 {
        with(|table| number(table.press(x, y, roll)))
    }

    /// Puts out what is believed: verdict (as of `player`), the recognized object or else the leader, touches, each object's
    /// posterior; then for each pose that the object may have, likeliest first: object, placement among those laid, x, y, yaw (NaN
    /// for any), share of all belief, halves of the 95 % intervals of x, y and yaw. Lengths are in millimeters and angles in
    /// radians. Returns how many poses.
    fn belief() -> i32 {
        with(|table| number(table.belief()))
    }

    /// Puts out the truth: object, placement among those laid, x, y, yaw.
    fn truth() -> i32 {
        with(|table| number(table.truth()))
    }
}
