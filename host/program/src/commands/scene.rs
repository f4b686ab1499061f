//! Options for the surroundings of objects: floating, or on a table.

use super::keys::one_of;
use palpate::mesh::{Object, placements};
use palpate::touches::Surroundings;
use palpate::wording::{counted, shares};
use palpate::{Error, Result};

/// The scene, and how objects lie in it.
#[derive(clap::Args, Clone, Debug, Default)]
pub(crate) struct SceneArguments {
    /// Scene: floating or table [default: floating]
    #[arg(long, value_name = "WHERE", value_parser = scene)]
    scene: Option<Surroundings>,
    /// Table: most degrees off vertical [default: 60]
    #[arg(long, value_name = "DEGREES")]
    cone: Option<f64>,
    #[command(flatten)]
    pub(crate) weights: PlacementArguments,
}

/// The placements of objects on a table, and how frequent they are.
#[derive(clap::Args, Clone, Debug, Default)]
pub(crate) struct PlacementArguments {
    /// Weights of placements, such as mug/+z=3; the rest of the object's are left out
    #[arg(long, value_name = "WEIGHTS", value_delimiter = ',', value_parser = weight)]
    placements: Vec<Weight>,
}

/// The weight of a placement.
#[derive(Clone, Debug, PartialEq)]
struct Weight {
    object: String,
    placement: String,
    weight: f64,
}

impl SceneArguments {
    /// The scene that the options state; without any, that of `base`.
    ///
    /// # Errors
    /// For options of a table where there is none, and a cone that cannot be.
    pub(crate) fn scene(&self, base: Surroundings) -> Result<Surroundings> {
        const TABLE: &str = "it with --scene table";
        let scene = match (self.scene.unwrap_or(base), self.cone) {
            (Surroundings::Floating, Some(cone)) => return Err(Error::setting("cone", cone, TABLE)),
            (Surroundings::Floating, None) if !self.weights.placements.is_empty() => {
                return Err(Error::setting("placements", "given", TABLE));
            }
            (Surroundings::Floating, None) => Surroundings::Floating,
            (Surroundings::Table { .. }, Some(cone)) => Surroundings::Table { cone },
            // The cone of a table that the option states is that of the data set to which objects are added.
            (Surroundings::Table { cone }, None) => Surroundings::Table { cone: base.cone().unwrap_or(cone) },
        };
        scene.check()?;
        Ok(scene)
    }
}

impl PlacementArguments {
    /// Gives objects the weights of their placements.
    ///
    /// # Errors
    /// For a weight of an object that is not there, or of a placement that already has one.
    pub(crate) fn weigh(&self, objects: &mut [Object]) -> Result<()> {
        for Weight { object, placement, weight } in &self.placements {
            let known = || objects.iter().map(|object| object.name.clone()).collect::<Vec<_>>().join(", ");
            let Some(place) = objects.iter().position(|own| own.name == *object) else {
                return Err(Error::setting("placements", object, format!("the name of an object: {}", known())));
            };
            let weights = &mut objects[place].placement_weights;
            if weights.iter().any(|(name, _)| name == placement) {
                return Err(Error::setting("placements", format!("{object}/{placement}"), "each placement once"));
            }
            weights.push((placement.clone(), *weight));
        }
        Ok(())
    }
}

/// The placements of objects, in words: how many, with their weights, and what was left out.
///
/// # Errors
/// Errors of [`placements::of_object`].
pub(crate) fn described(objects: &[Object]) -> Result<String> {
    let mut text = String::new();
    for object in objects {
        let has_several = object.instances().len() > 1;
        for (instance, found) in object.instances().zip(placements::of_object(object)?) {
            let of = if has_several { format!(", {}", instance.name) } else { String::new() };
            let count = counted(found.placements.len(), "placement", "placements");
            let left_out = match listed(&found.left_out) {
                none if none.is_empty() => none,
                rare => format!("; left out: {rare}"),
            };
            text += &format!(
                "{}{of}: {count}: {}{left_out}. The center of mass is {}.\n",
                object.name,
                listed(&found.placements),
                found.center
            );
        }
    }
    Ok(text)
}

fn listed(placements: &[placements::Placement]) -> String {
    shares(placements.iter().map(|placement| (&placement.name, placement.weight)))
}

fn scene(name: &str) -> Result<Surroundings, String> {
    one_of(name, [("floating", Surroundings::Floating), ("table", Surroundings::Table { cone: Surroundings::CONE })])
}

fn weight(text: &str) -> Result<Weight, String> {
    let parts = || {
        let (name, weight) = text.rsplit_once('=')?;
        let (object, placement) = name.rsplit_once('/')?;
        let weight = weight.parse().ok().filter(|weight: &f64| weight.is_finite() && *weight >= 0.0)?;
        Some(Weight { object: object.into(), placement: placement.into(), weight })
    };
    parts()
        .ok_or_else(|| "give an object, one of its placements and a weight of 0 or more, such as mug/+z=3".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate::mesh::Mesh;

    #[test]
    fn weights_name_an_object_and_a_placement() {
        let expected = |weight| Weight { object: "mug".into(), placement: "+x-y".into(), weight };
        assert_eq!(weight("mug/+x-y=2.5"), Ok(expected(2.5)));
        assert_eq!(weight("mug/+x-y=0"), Ok(expected(0.0)));
        for text in ["mug/+z", "mug=1", "+z=1", "mug/+z=-1", "mug/+z=x", "mug/+z=inf", ""] {
            assert!(weight(text).is_err(), "{text}");
        }
    }

    #[test]
    fn options_of_a_table_need_one() {
        let table = Surroundings::Table { cone: 30.0 };
        let cone = SceneArguments { cone: Some(45.0), ..SceneArguments::default() };
        assert!(cone.scene(Surroundings::Floating).is_err());
        assert_eq!(cone.scene(table).unwrap(), Surroundings::Table { cone: 45.0 });
        let weights = PlacementArguments { placements: vec![weight("mug/+z=1").unwrap()] };
        let placed = SceneArguments { weights, ..SceneArguments::default() };
        assert!(placed.scene(Surroundings::Floating).is_err());
        assert_eq!(placed.scene(table).unwrap(), table);
        let on_table = SceneArguments { scene: scene("table").ok(), ..SceneArguments::default() };
        assert_eq!(on_table.scene(Surroundings::Floating).unwrap(), Surroundings::Table { cone: 60.0 });
        assert_eq!(on_table.scene(table).unwrap(), table, "the cone of the data set that is added to");
        let steep = SceneArguments { cone: Some(120.0), ..on_table };
        assert!(steep.scene(Surroundings::Floating).is_err());
    }

    #[test]
    fn weights_of_unknown_objects_and_two_weights_of_one_placement_are_refused() {
        let mut objects = [Object::new("mug", Mesh::globe(6))];
        let arguments = |texts: &[&str]| PlacementArguments {
            placements: texts.iter().map(|text| weight(text).unwrap()).collect(),
        };
        assert!(arguments(&["cup/+z=1"]).weigh(&mut objects).unwrap_err().to_string().contains("mug"));
        assert!(arguments(&["mug/+z=1", "mug/+z=2"]).weigh(&mut objects).is_err());
    }
}
