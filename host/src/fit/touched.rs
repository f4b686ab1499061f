//! Objects that recordings may be of: as they float or, on a table, in any of their placements, or in one that recordings state.

use crate::mesh::Object;
use crate::probe::scene::Scene;
use crate::touches::Dataset;

/// An object, or one of its placements, that recordings may be of.
#[derive(Debug)]
pub(super) struct Touched {
    /// The object's name, or `object/placement`.
    pub(super) name: String,
    /// One for each instance, or placement of each.
    pub(super) scenes: Vec<Scene>,
    /// Relative frequencies of touching each.
    pub(super) weights: Vec<f64>,
}

impl Touched {
    /// For each scene the share of the largest weight.
    pub(super) fn shares(&self) -> Vec<f64> {
        let most = self.weights.iter().copied().fold(0.0, f64::max);
        self.weights.iter().map(|weight| if most > 0.0 { weight / most } else { 1.0 }).collect()
    }
}

/// The placements of objects on a table, called `object/placement`; none of objects that float.
pub(super) fn placements(objects: &[Object], scenes: &[Vec<Scene>]) -> Vec<String> {
    let of = |(object, scenes): (&Object, &Vec<Scene>)| {
        let name = |scene: &Scene| scene.table().map(|table| format!("{}/{}", object.name, table.placement));
        scenes.iter().filter_map(name).collect::<Vec<_>>()
    };
    let mut names: Vec<String> = objects.iter().zip(scenes).flat_map(of).collect();
    names.sort();
    names.dedup();
    names
}

/// The objects, or their placements, where all recordings of an object state theirs.
pub(super) fn touched(objects: &[Object], scenes: Vec<Vec<Scene>>, recorded: &Dataset) -> Vec<Touched> {
    let mut all = Vec::new();
    for (object, scenes) in objects.iter().zip(scenes) {
        let is_stated = |name: &str| name.rsplit_once('/').is_some_and(|(whole, _)| whole == object.name);
        let has = |is: &dyn Fn(&str) -> bool| recorded.objects.iter().any(|own| is(&own.name));
        let is_divided = has(&is_stated) && !has(&|name| name == object.name);
        let weight = |scene: &Scene| scene.table().map_or(1.0, |table| table.weight);
        if !is_divided || scenes.iter().any(|scene| scene.table().is_none()) {
            let weights = scenes.iter().map(weight).collect();
            all.push(Touched { name: object.name.clone(), scenes, weights });
            continue;
        }
        for scene in scenes {
            let placement = scene.table().map_or("", |table| &table.placement);
            let name = format!("{}/{placement}", object.name);
            match all.iter_mut().find(|own: &&mut Touched| own.name == name) {
                Some(own) => {
                    own.scenes.push(scene);
                    own.weights.push(1.0);
                }
                None => all.push(Touched { name, scenes: vec![scene], weights: vec![1.0] }),
            }
        }
    }
    all
}

/// The index of the subject of a recording with this name: an object, its placement, or the object of a placement.
pub(super) fn place<'a>(name: &str, known: impl Iterator<Item = &'a str> + Clone) -> Option<usize> {
    let whole = name.rsplit_once('/').map(|(whole, _)| whole);
    let find = |name: &str| known.clone().position(|own| own == name);
    find(name).or_else(|| find(whole?))
}
