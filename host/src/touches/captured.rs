//! Identity of the touches of a capture, so that the same ones are known again.

use super::{Dataset, ObjectTouches, Origin};
use palpate_shared::format::{Length, TrainedCapture};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::Range;

/// The meshes of a touched object.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Meshes {
    /// The [checksum](crate::mesh::Mesh::checksum) of each instance's mesh, as it was read, in hexadecimal digits.
    pub checksums: Vec<String>,
    /// Number of millimeters in a unit of the meshes, if the object was touched at its true size.
    pub millimeters: Option<f64>,
}

/// The settings that the touches of a capture are a function of, and the range of its samples. A sample depends on
/// seed, settings, meshes and its number, not on how many others there are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Stated", into = "Stated")]
pub struct Captured {
    /// Checksum of the seed, and of all settings that change a touch but not which touches are kept.
    settings: u64,
    /// The samples of each object.
    samples: Range<u64>,
    /// For each object, of its meshes and its name.
    objects: BTreeMap<String, u64>,
}

const CRC: crc::Crc<u64> = crc::Crc::<u64>::new(&crc::CRC_64_XZ);

impl Captured {
    /// Identity of the touches of a data set, or of a part of one; nothing if no capture of this version or later made
    /// them.
    pub fn of(dataset: &Dataset) -> Option<Self> {
        let origin = dataset.origin.as_ref().filter(|_| !dataset.is_recorded())?;
        let object = |object: &ObjectTouches| {
            let (name, meshes) = (&object.name, object.meshes()?);
            let mut digest = CRC.digest();
            digest.update(name.as_bytes());
            digest.update(&[0]);
            if let Some(millimeters) = meshes.millimeters.filter(|_| origin.unit == Length::Millimeter) {
                digest.update(&millimeters.to_bits().to_le_bytes());
            }
            meshes.checksums.iter().for_each(|checksum| digest.update(checksum.as_bytes()));
            Some((name.clone(), digest.finalize()))
        };
        let objects: BTreeMap<String, u64> = dataset.objects.iter().filter_map(object).collect();
        (!objects.is_empty()).then(|| Self { settings: settings(origin), samples: origin.samples(), objects })
    }

    /// The objects with touches that `other` has, too.
    pub fn shared<'o>(&self, other: &'o Self) -> Vec<&'o str> {
        let is_near = self.settings == other.settings && overlap(&self.samples, &other.samples);
        let is_same = |(name, own): &(&String, &u64)| is_near && self.objects.get(*name) == Some(*own);
        other.objects.iter().filter(is_same).map(|(name, _)| name.as_str()).collect()
    }

    /// Statement of a compiled model about it, except the objects.
    pub(crate) fn stated(&self) -> (u16, Range<u32>) {
        let number = |sample: u64| u32::try_from(sample).unwrap_or(u32::MAX);
        (short(self.settings), number(self.samples.start)..number(self.samples.end))
    }

    /// Statement of a compiled model about an object.
    pub(crate) fn stated_of(&self, object: &str) -> Option<u16> {
        self.objects.get(object).map(|&object| short(object))
    }

    /// True if a compiled model's statement is about these settings, and some of these samples.
    pub(crate) fn is_near(&self, stated: &TrainedCapture<'_>) -> bool {
        let (settings, samples) = self.stated();
        let end = |range: &Range<u32>| if range.end == u32::MAX { u64::MAX } else { range.end.into() };
        let range = |range: &Range<u32>| range.start.into()..end(range);
        settings == stated.settings && overlap(&range(&samples), &range(&stated.samples))
    }
}

/// The part of a checksum that a compiled model states; never 0, which stands for none.
pub(crate) fn short(checksum: u64) -> u16 {
    // The upper bits, all that are left.
    u16::try_from(checksum >> 48).unwrap_or_default().max(1)
}

fn overlap(a: &Range<u64>, b: &Range<u64>) -> bool {
    a.start < b.end && b.start < a.end
}

/// A checksum of what a touch depends on beside its mesh and its number. What is kept of it (its pose, full touches or all
/// approaches, what a real probe adds) does not count: data sets that differ in that alone share touches.
fn settings(origin: &Origin) -> u64 {
    let Origin { seed, unit, length, probe, aim, scene, position, within, .. } = origin;
    // At true size the length means nothing.
    let length = if *unit == Length::Tenth { *length } else { 0.0 };
    let (radius, spacing, tilt) = (probe.radius, probe.spacing, probe.tilt);
    let mut text = format!("{seed} {} {length} {radius} {spacing} {tilt} {}", unit.name(), aim.name());
    if let Some(cone) = scene.cone() {
        text += &format!(" {cone}");
    }
    // Approaches with a position are drawn in another way, and end on the table finger by finger.
    if *position {
        text += &format!(" position {}", within.map_or("box".into(), |within| within.to_string()));
    }
    CRC.checksum(text.as_bytes())
}

/// [`Captured`] in files: checksums as text, since JSON's numbers lose digits.
#[derive(Serialize, Deserialize)]
struct Stated {
    settings: String,
    samples: [u64; 2],
    objects: BTreeMap<String, String>,
}

impl From<Captured> for Stated {
    fn from(Captured { settings, samples, objects }: Captured) -> Self {
        let text = |number: u64| format!("{number:016x}");
        let objects = objects.into_iter().map(|(name, object)| (name, text(object))).collect();
        Self { settings: text(settings), samples: [samples.start, samples.end], objects }
    }
}

impl TryFrom<Stated> for Captured {
    type Error = String;

    fn try_from(Stated { settings, samples: [start, end], objects }: Stated) -> Result<Self, String> {
        let number = |text: &String| {
            u64::from_str_radix(text, 16).map_err(|_| format!("{text:?}, where a hexadecimal number is expected"))
        };
        let object = |(name, text): (String, String)| Ok((name, number(&text)?));
        let objects = objects.into_iter().map(object).collect::<Result<_, String>>()?;
        Ok(Self { settings: number(&settings)?, samples: start..end, objects })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::{Settings, in_memory};
    use crate::mesh::{Mesh, Object};
    use crate::touches::Samples;
    use crate::with;

    fn captured(width: f32, origin: Origin) -> Captured {
        let objects = [("globe", 1.0), ("disc", width)]
            .map(|(name, width)| Object::new(name, Mesh::globe(5).stretched([1.0, 1.0, width])));
        Captured::of(&in_memory(&objects, &Settings::from(origin), &()).unwrap().0).unwrap()
    }

    #[test]
    fn the_same_seed_objects_and_settings_are_the_same_touches_however_many() {
        let origin = |touches| Origin { touches, ..Origin::default() };
        let part = |first, end| Origin { samples: Some(Samples { first, end }), ..origin(20) };
        let trained = captured(0.5, origin(10));
        assert_eq!(trained.shared(&captured(0.5, origin(30))), ["disc", "globe"]);
        let kept = Origin { approaches: true, pose: true, ..origin(5) };
        assert_eq!(trained.shared(&captured(0.5, kept)), ["disc", "globe"], "approaches, some of them full");
        assert_eq!(trained.shared(&captured(0.4, origin(10))), ["globe"], "another mesh of the other");
        // Of the whole, one half has these samples and the other one has not.
        assert_eq!(trained.shared(&captured(0.5, part(0, 10))), ["disc", "globe"]);
        assert!(trained.shared(&captured(0.5, part(10, 20))).is_empty());
        assert!(trained.shared(&captured(0.5, Origin { seed: 2, ..origin(10) })).is_empty());
        let probe = with!(crate::probe::approach::Probe::default(), spacing = 1.6);
        assert!(trained.shared(&captured(0.5, Origin { probe, ..origin(10) })).is_empty());
    }

    #[test]
    fn what_is_captured_is_read_as_it_was_written_and_nonsense_is_refused() {
        let captured = captured(0.5, Origin { touches: 3, ..Origin::default() });
        let text = serde_json::to_string(&captured).unwrap();
        assert_eq!(serde_json::from_str::<Captured>(&text).unwrap(), captured);
        let error = serde_json::from_str::<Captured>(r#"{"settings": "x", "samples": [0, 1], "objects": {}}"#);
        assert!(error.unwrap_err().to_string().contains("\"x\", where a hexadecimal number is expected"));
    }
}
