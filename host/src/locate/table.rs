//! Height of the table and offsets of fingertips, from presses on the bare table.

use super::Hand;
use super::contacts::{Met, tips};
use super::refused::{not_down, nowhere};
use crate::error::{Error, Place, Result, problem};
use crate::probe::approach::{FINGERS, Probe};
use nalgebra::{SMatrix, SVector};
use palpate_shared::Touch;
use serde::Serialize;
use std::fmt::Write as _;

/// The fewest presses in which each finger must have met the table.
const LEAST_PRESSES: usize = 10;
/// A contact is with the table if it is this close to it, in millimeters, and no outlier.
const NEAR: f64 = 5.0;
/// Largest share of contacts that are not with the table.
const MOST_ASIDE: f64 = 0.25;
/// A contact is an outlier beyond as many standard deviations.
const OUTLIER: f64 = 4.0;
/// Reach of approaches from the table's origin with the default range of maps, in millimeters.
pub const REACH: f64 = 60.0;
/// Rise of the table over that reach which maps can bear, in millimeters.
const BEARABLE: f64 = 1.0;

/// An estimate in millimeters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Measured {
    /// Its value.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
}

/// The table and the fingertips, from presses on the bare table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BareTable {
    /// Presses.
    pub presses: usize,
    /// Contacts with the table.
    pub contacts: usize,
    /// Contacts that are missing.
    pub lost: usize,
    /// Contacts with something else, and outliers.
    pub left_out: usize,
    /// Height of the table amid the presses, as the middle finger meets it.
    pub height: Measured,
    /// Length by which the first and the third fingertip stand out beyond the middle one: as much higher do they meet the table.
    pub tips: [Measured; 2],
    /// Rise of the table over [`REACH`], in its steepest direction.
    pub rise: Measured,
    /// Standard deviation of a contact's height.
    pub noise: f64,
}

/// Height; offsets of the first and the third fingertip; slopes along x and y.
const NUMBERS: usize = 5;
type Numbers = SVector<f64, NUMBERS>;
type Square = SMatrix<f64, NUMBERS, NUMBERS>;

struct Contact {
    press: usize,
    finger: usize,
    factors: Numbers,
    height: f64,
}

impl Contact {
    fn off(&self, found: &Numbers) -> f64 {
        self.height - self.factors.dot(found)
    }
}

/// Measures the table and the fingertips by presses of a probe in millimeters straight down on the bare table, each with its
/// place in a file.
///
/// Outliers are left out, and the rest is fitted by least squares with the table as a plane. Standard errors are those of whole
/// presses, since the three fingers share an error of the hand's position.
///
/// # Errors
/// With the place of the press: a touch without a position, [`Kind::NotDown`](crate::error::Kind::NotDown), and more than a quarter of the contacts with
/// something else. When there are too few presses, their places do not show the slope of the table, or it is not level.
pub fn bare_table(presses: &[(Place, Touch)], probe: &Probe) -> Result<BareTable> {
    let contacts = contacts(presses, probe)?;
    let mut all: Vec<f64> = contacts.iter().map(|contact| contact.height).collect();
    let mut found = Numbers::zeros();
    found[0] = median(&mut all).ok_or_else(|| few_presses(1, 0))?;
    let (mut kept, mut inverse, mut limit) = (Vec::new(), Square::zeros(), NEAR);
    for _ in 0..10 {
        kept = contacts.iter().filter(|contact| contact.off(&found).abs() <= limit).collect();
        check(presses, &contacts, &kept, &found)?;
        let normal: Square = kept.iter().map(|contact| contact.factors * contact.factors.transpose()).sum();
        let moment: Numbers = kept.iter().map(|contact| contact.factors * contact.height).sum();
        // Slopes must be as certain as what maps can bear, with their usual noise.
        let is_certain = |inverse: &Square| {
            [3, 4]
                .into_iter()
                .all(|slope| inverse[(slope, slope)].sqrt() * super::CastSettings::default().noise * REACH <= BEARABLE)
        };
        inverse = normal.try_inverse().filter(is_certain).ok_or_else(one_place)?;
        found = inverse * moment;
        let mut off: Vec<f64> = kept.iter().map(|contact| contact.off(&found).abs()).collect();
        limit = (OUTLIER * 1.4826 * median(&mut off).unwrap_or(0.0)).clamp(0.05, NEAR);
    }
    let squares: f64 = kept.iter().map(|contact| contact.off(&found).powi(2)).sum();
    let mut of_presses = vec![Numbers::zeros(); presses.len()];
    for contact in &kept {
        of_presses[contact.press] += contact.factors * contact.off(&found);
    }
    let pressed = of_presses.iter().filter(|own| own.norm() > 0.0).count().max(4) as f64;
    let spread: Square = of_presses.iter().map(|own| own * own.transpose()).sum();
    // Height and slopes are estimated from as many presses.
    let covariance = inverse * spread * inverse * (pressed / (pressed - 3.0));
    let measured = |number: usize| Measured { value: found[number], error: covariance[(number, number)].sqrt() };
    let rise = steepest([found[3], found[4]], &covariance);
    if rise.value - 2.0 * rise.error > BEARABLE {
        let toward = found[4].atan2(found[3]).to_degrees();
        return Err(problem!(
            "the table rises by {:.1} mm in {REACH:.0} mm, toward {toward:.0}° from the x axis",
            rise.value
        )
        .fix("Level the table, or turn the frame of positions so that z is 0 all over it."));
    }
    Ok(BareTable {
        presses: presses.len(),
        contacts: kept.len(),
        lost: FINGERS * presses.len() - contacts.len(),
        left_out: contacts.len() - kept.len(),
        height: measured(0),
        tips: [measured(1), measured(2)],
        rise,
        noise: (squares / (kept.len() - NUMBERS) as f64).sqrt(),
    })
}

/// Rise over the reach in the steepest direction.
fn steepest(slopes: [f64; 2], covariance: &Square) -> Measured {
    let [x, y] = slopes;
    let steepness = x.hypot(y);
    let along = Numbers::from([0.0, 0.0, 0.0, x, y]) / steepness.max(f64::MIN_POSITIVE);
    Measured { value: steepness * REACH, error: (along.transpose() * covariance * along)[0].sqrt() * REACH }
}

fn contacts(presses: &[(Place, Touch)], probe: &Probe) -> Result<Vec<Contact>> {
    let (mut all, any) = (Vec::new(), Hand { spacing: 0, speed: 0, stroke: None });
    for (press, (place, touch)) in presses.iter().enumerate() {
        let met = heights(touch, probe).ok_or_else(|| nowhere().at(place.clone()))?;
        if any.seen(touch).is_none() {
            return Err(not_down().at(place.clone()));
        }
        all.extend(met.into_iter().enumerate().filter_map(|(finger, met)| Some((press, finger, met?))));
    }
    let count = all.len().max(1) as f64;
    let [x, y] = all.iter().fold([0.0; 2], |[x, y], (_, _, met)| [x + met.x / count, y + met.y / count]);
    let contact = |(press, finger, met): (usize, usize, Met)| {
        let is = |other: usize| f64::from(u8::from(finger == other));
        let factors = Numbers::from([1.0, is(0), is(2), met.x - x, met.y - y]);
        Contact { press, finger, factors, height: met.height }
    };
    Ok(all.into_iter().map(contact).collect())
}

/// The problem of a finger, counted from 1, that met the bare table too rarely.
fn few_presses(finger: usize, presses: usize) -> Error {
    problem!("finger {finger} met the table in only {presses} presses, of at least {LEAST_PRESSES}")
        .fix("Record 20 presses, and look for a finger that often stays open.")
}

/// The problem of presses that do not show the slope of the table.
fn one_place() -> Error {
    problem!("from these presses the slope of the table cannot be told from offsets of the fingertips")
        .fix("Press all over the table, and turn the hand by half a turn after each press.")
}

/// Refuses presses that met something else, and too few of them.
fn check(presses: &[(Place, Touch)], all: &[Contact], kept: &[&Contact], found: &Numbers) -> Result<()> {
    let aside = all.len() - kept.len();
    if aside as f64 > MOST_ASIDE * all.len() as f64 {
        let farthest = all.iter().max_by(|a, b| a.off(found).abs().total_cmp(&b.off(found).abs()));
        let (place, off) = farthest.map_or_else(Default::default, |own| (presses[own.press].0.clone(), own.off(found)));
        return Err(problem!(
            "a contact is {:.1} mm {} the table, and {aside} of {} contacts are not with it",
            off.abs(),
            if off > 0.0 { "above" } else { "below" },
            all.len()
        )
        .fix("Press beside the object, on one level table.")
        .at(place));
    }
    for finger in 0..FINGERS {
        let presses = kept.iter().filter(|contact| contact.finger == finger).count();
        if presses < LEAST_PRESSES {
            return Err(few_presses(finger + 1, presses));
        }
    }
    Ok(())
}

impl BareTable {
    /// True if the table is so slanted that it costs approaches.
    pub fn is_slanted(&self) -> bool {
        self.rise.value > (BEARABLE / 2.0).max(3.0 * self.rise.error)
    }

    /// The probe as the text of a `probe.toml`, with its fingertips and noise.
    pub fn toml(&self, probe: &Probe) -> String {
        let Probe { radius, spacing, speed, tilt, stroke, travel, stroke_tolerance, .. } = probe;
        let [first, third] = self.tips;
        let mut text = format!(
            "# Found by `palpate probe fit` from {} presses on a bare table, {:.3} ± {:.3} mm high.\n\
             unit = \"mm\"\nradius = {radius:?}\nspacing = {spacing:?}\nspeed = {speed:?}\ntilt = {tilt:?}\n",
            self.presses, self.height.value, self.height.error,
        );
        for (name, length) in [("stroke", stroke), ("stroke_tolerance", stroke_tolerance), ("travel", travel)] {
            if let Some(length) = length {
                // Writing to a string cannot fail.
                _ = writeln!(text, "{name} = {length:?}");
            }
        }
        text + &format!(
            "\n[real]\noffsets = [{:.3}, 0.0, {:.3}]  # ± {:.3} and ± {:.3}\nnoise = \"{:.3}ms\"\n",
            first.value,
            third.value,
            first.error,
            third.error,
            self.noise / speed * 1e3,
        )
    }
}

/// Heights that the fingers of a touch met; none without a position or pose.
fn heights(touch: &Touch, probe: &Probe) -> Option<[Option<Met>; FINGERS]> {
    let (tips, times) = (tips(touch, probe)?, touch.times());
    Some(std::array::from_fn(|finger| {
        let micros = times[finger].micros()?;
        let Met { x, y, height } = tips[finger];
        Some(Met { x, y, height: height - f64::from(micros) * 1e-6 * probe.speed })
    }))
}

fn median(heights: &mut [f64]) -> Option<f64> {
    heights.sort_unstable_by(f64::total_cmp);
    let (low, high) = (heights.get(heights.len().checked_sub(1)? / 2)?, heights.get(heights.len() / 2)?);
    Some((low + high) / 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, generator};
    use crate::with;
    use palpate_shared::{ContactTime, Pose, Position};
    use rand::RngExt;
    use rand_distr::{Distribution, StandardNormal};
    use std::sync::LazyLock;

    static PROBE: LazyLock<Probe> = LazyLock::new(|| {
        with!(Probe::default(), radius = 1.5, spacing = 15.0, speed = 100.0, tilt = 0.0, stroke = Some(20.0))
    });

    /// A hand whose fingertips stand out by `tips` on a table at this height with these slopes, or on the heights that `meets` says.
    struct Robot {
        height: f64,
        tips: [f64; FINGERS],
        slopes: [f64; 2],
        /// Standard deviation of a finger's height, and of the hand's.
        noise: [f64; 2],
        lost: f64,
        /// Half of the side of the square that presses are in.
        within: f64,
        turns: bool,
    }

    const ROBOT: Robot = Robot {
        height: 0.8,
        tips: [0.6, 0.0, -0.9],
        slopes: [0.0; 2],
        noise: [0.5, 0.0],
        lost: 0.02,
        within: 40.0,
        turns: true,
    };

    impl Robot {
        fn presses(&self, count: u64, seed: u64) -> Vec<(Place, Touch)> {
            (0..count).map(|number| (Place::line("presses.txt", number + 1), self.press(seed, number))).collect()
        }

        fn press(&self, seed: u64, number: u64) -> Touch {
            let mut random = generator(seed, Purpose::Synthetic, "", number);
            let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
            let (hand, noise) = (self.noise[1] * normal(), [normal(), normal(), normal()]);
            let place = [0; 2].map(|_| (2.0 * random.random::<f64>() - 1.0) * self.within);
            let roll = if self.turns { random.random::<f64>() * std::f64::consts::TAU } else { 0.3 };
            let heights: [Option<f64>; FINGERS] = std::array::from_fn(|finger| {
                let along = (finger as f64 - 1.0) * PROBE.spacing;
                let [x, y] = [place[0] + along * roll.cos(), place[1] + along * roll.sin()];
                let plane = self.height + self.slopes[0] * x + self.slopes[1] * y;
                let height = plane + self.tips[finger] + hand + self.noise[0] * noise[finger];
                (random.random::<f64>() >= self.lost).then_some(height)
            });
            touch(place, roll, heights)
        }
    }

    fn touch(place: [f64; 2], roll: f64, heights: [Option<f64>; FINGERS]) -> Touch {
        let first = heights.iter().flatten().copied().reduce(f64::max).unwrap_or(0.0);
        let times = heights.map(|height| match height {
            Some(height) => ContactTime::from_micros(((first - height) / PROBE.speed * 1e6).round() as u32),
            None => ContactTime::MISSING,
        });
        let alignment = [roll.cos(), roll.sin(), 0.0].map(crate::probe::approach::to_q15);
        let micrometers = [place[0], place[1], first].map(|length| (length * 1e3).round() as i32);
        Touch::new(times)
            .with_pose(Pose { direction: [0, 0, -32_767], alignment })
            .with_position(Position { micrometers })
    }

    #[test]
    fn offsets_and_height_are_found_within_the_stated_errors() {
        // Of each number how often it is within two standard errors, and how large these are.
        for (robot, count, most) in [
            (ROBOT, 20, 0.25),
            (Robot { noise: [0.3, 0.5], ..ROBOT }, 20, 0.25),
            (Robot { slopes: [0.004, -0.003], height: -140.0, ..ROBOT }, 40, 0.2),
        ] {
            let (mut within, mut errors) = ([0; 3], 0.0);
            for seed in 0..200 {
                let mut presses = robot.presses(count, seed);
                // An object stood there once.
                presses[3].1 = touch([20.0, 10.0], 1.0, [Some(robot.height + 30.0), Some(robot.height + 28.0), None]);
                let found = bare_table(&presses, &PROBE).unwrap();
                let middle: f64 = presses
                    .iter()
                    .filter_map(|(_, touch)| heights(touch, &PROBE))
                    .flatten()
                    .flatten()
                    .map(|met| robot.slopes[0] * met.x + robot.slopes[1] * met.y)
                    .sum::<f64>()
                    / (found.contacts + found.left_out) as f64;
                let [first, third] = found.tips;
                let all = [(found.height, robot.height + middle), (first, robot.tips[0]), (third, robot.tips[2])];
                for (within, (measured, truth)) in within.iter_mut().zip(all) {
                    *within += u32::from((measured.value - truth).abs() <= 2.0 * measured.error);
                    errors += measured.error / 600.0;
                }
                assert!(found.left_out >= 2 && found.lost < 10, "{found:?}");
            }
            assert!(within.iter().all(|&within| within >= 180), "{within:?} of 200");
            assert!(errors < most, "{errors}");
        }
    }

    #[test]
    fn presses_that_say_nothing_are_refused_with_their_line() {
        let refused = |presses: &[(Place, Touch)]| bare_table(presses, &PROBE).unwrap_err().to_string();
        let mut presses = ROBOT.presses(20, 1);
        presses[4].1 = Touch::new(presses[4].1.times());
        assert!(refused(&presses).starts_with("presses.txt:5: the touch has no position"), "{}", refused(&presses));
        let askew = Pose { direction: [0, 20_000, -25_955], alignment: [32_767, 0, 0] };
        presses[4].1 = presses[5].1.with_pose(askew);
        assert!(
            refused(&presses).starts_with("presses.txt:5: it does not come straight down"),
            "{}",
            refused(&presses)
        );
        assert!(
            refused(&ROBOT.presses(8, 1)).contains("finger 1 met the table in "),
            "{}",
            refused(&ROBOT.presses(8, 1))
        );
        assert!(refused(&[]).contains("in only 0 presses"), "{}", refused(&[]));
        let mut presses = ROBOT.presses(20, 1);
        for (number, (_, press)) in presses.iter_mut().enumerate().skip(10) {
            *press = touch([number as f64, 2.0], 0.0, [Some(25.0), Some(26.0 + number as f64), None]);
        }
        assert!(refused(&presses).starts_with("presses.txt:20: a contact is "), "{}", refused(&presses));
        let slanted = refused(&Robot { slopes: [0.05, 0.0], ..ROBOT }.presses(20, 1));
        assert!(slanted.starts_with("the table rises by ") && slanted.contains(" in 60 mm"), "{slanted}");
        // At one place, with the same turn, a slope looks like offsets.
        let still = Robot { within: 0.0, turns: false, ..ROBOT };
        assert!(refused(&still.presses(20, 1)).contains("turn the hand"), "{}", refused(&still.presses(20, 1)));
        assert!(bare_table(&Robot { within: 0.0, ..ROBOT }.presses(20, 1), &PROBE).is_ok());
    }

    #[test]
    fn a_slope_that_maps_can_bear_is_reported() {
        let found = bare_table(&Robot { slopes: [0.0, 0.014], ..ROBOT }.presses(40, 2), &PROBE).unwrap();
        assert!(found.is_slanted() && (found.rise.value - 0.84).abs() < 3.0 * found.rise.error, "{found:?}");
        let level = bare_table(&Robot { noise: [0.0; 2], lost: 0.0, ..ROBOT }.presses(20, 2), &PROBE).unwrap();
        assert!(!level.is_slanted() && level.noise < 0.01 && (level.tips[1].value + 0.9).abs() < 0.01, "{level:?}");
    }

    #[test]
    fn the_probe_file_states_the_fingertips() {
        let found = bare_table(&Robot { noise: [0.05, 0.0], ..ROBOT }.presses(40, 1), &PROBE).unwrap();
        let file = crate::probe::file::ProbeFile::parse(&found.toml(&PROBE), "hand.toml".as_ref()).unwrap();
        assert_eq!(file.probe, *PROBE);
        let out = file.real.bent.map(|time| time * PROBE.speed / 1e6);
        assert!((out[0] - 0.6).abs() < 0.05 && out[1] == 0.0 && (out[2] + 0.9).abs() < 0.05, "{out:?}");
    }
}
