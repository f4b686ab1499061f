//! From XGBoost's schema to an ensemble, everything checked.

use super::objective::{Kind, Objective};
use super::schema::{Document, Forest, GradientBooster, Learner, TreeColumns};
use super::trees::{Shape, has_sets, tree};
use super::without_trees;
use crate::ensemble::check::check_names;
use crate::ensemble::faults::no_trees;
use crate::ensemble::faults::{self, DAMAGED};
use crate::ensemble::import::options::{
    CATEGORIES, MISSING_UNKNOWN, Options, STOPPED_EARLY, default_names, named, one_class, unknown_objective,
};
use crate::ensemble::{Ensemble, Imported, Inputs, Node, Probability, Provenance, Schema, Tree, columns};
use crate::error::{Error, Result, problem};
use palpate_shared::format::{Link as Inverse, Prediction};
use std::collections::BTreeMap;

type Attributes = BTreeMap<String, String>;

impl Document {
    /// The ensemble in the document: over the features of a schema if it names one, else over rows. `names` are the objects'
    /// names; `kind` is JSON or UBJSON.
    pub(super) fn into_ensemble(self, options: &Options<'_>, kind: &str) -> Result<Ensemble> {
        let names = options.names;
        let [major, minor, _] = self.version;
        let unknown_as_missing = (major, minor) < (1, 7);
        let version = self.version.map(|number| number.to_string()).join(".");
        let Learner { attributes, feature_names, gradient_booster, learner_model_param, objective, .. } = self.learner;
        let (forest, weights) = forest(gradient_booster)?;
        let Objective { kind: outputs, link, inverse } = Objective::named(&objective.name)?;
        let classes = count("num_class", &learner_model_param.num_class)?;
        let targets = count("num_target", &learner_model_param.num_target)?;
        let groups = match outputs {
            Kind::Classes if classes == 1 => return Err(one_class()),
            Kind::Classes => classes,
            Kind::One => targets.max(1),
            Kind::Binary if targets > 1 => {
                return Err(problem!(
                    "it has {targets} labels, each of which is there or not, and not one of several classes"
                )
                .fix("Train a model for each label."));
            }
            Kind::Binary => 1,
        };
        let first = usize::from(outputs == Kind::Binary);
        let objects = groups + first;
        let features = count("num_feature", &learner_model_param.num_feature)?;
        let (inputs, objects) = match attributes.get("palpate_descriptor") {
            Some(name) => {
                let schema = schema(name, options.schemas)?;
                if outputs != Kind::Classes {
                    return Err(unknown_objective(&objective.name, Some(schema.of)));
                }
                if features != schema.features.len() {
                    let Schema { name, features: own, .. } = schema;
                    let (wanted, own) = (own.len(), own.join(", "));
                    return Err(problem!("it has {features} features, but its descriptor {name} has {wanted} ({own})")
                        .fix("Train it on that descriptor's features, or name the right descriptor."));
                }
                let own = object_names(&attributes)?.ok_or_else(|| {
                    problem!("it has no attribute palpate_objects").fix(
                        "Before saving it in Python, set it: `booster.set_attr(palpate_objects='[\"bowl\", \"fork\"]')`.",
                    )
                })?;
                if classes != own.len() {
                    return Err(other_classes(classes, own.len()));
                }
                (Inputs::Computed(schema), named(names, own)?)
            }
            None => {
                let own = object_names(&attributes)?.unwrap_or_else(|| default_names(objects, outputs == Kind::One));
                if own.len() != objects {
                    return Err(other_classes(objects, own.len()));
                }
                columns::check_count(features)?;
                let are_named = feature_names.len() == features;
                let inputs = if are_named { Inputs::Rows(feature_names) } else { Inputs::unnamed(features) };
                (inputs, named(names, own)?)
            }
        };
        let mut base_margins = vec![0.0; first];
        base_margins.extend(base_scores(&learner_model_param.base_score, groups)?.into_iter().map(|b| link.margin(b)));
        if base_margins.iter().any(|margin| !margin.is_finite()) {
            let (score, objective) = (learner_model_param.base_score, objective.name);
            return Err(problem!("its base_score {score} is no margin under {objective}")
                .fix("Train on labels that are not all the same."));
        }
        let mut notes = Vec::new();
        let taken = taken(&forest, &attributes, groups, options.all_trees, &mut notes)?;
        let Forest { tree_info, trees, cats, .. } = forest;
        let named = cats.get("enc").and_then(serde_json::Value::as_array).into_iter().flatten().map(category_names);
        let categories =
            named.map(Option::unwrap_or_default).enumerate().filter(|(_, names)| !names.is_empty()).collect();
        if trees.is_empty() {
            return Err(no_trees());
        }
        if tree_info.len() != trees.len() {
            let (found, trees) = (tree_info.len(), trees.len());
            return Err(problem!("tree_info has {found} entries for {trees} trees").fix(DAMAGED));
        }
        if let Some(found) = weights.as_ref().map(Vec::len).filter(|&found| found != trees.len()) {
            return Err(problem!("weight_drop has {found} entries for {} trees", trees.len()).fix(DAMAGED));
        }
        let shape = Shape {
            features: inputs.names().into_iter().map(String::from).collect(),
            groups,
            first,
            infinite: inputs.schema().is_none(),
            unknown_as_missing,
        };
        let read = |((number, columns), group): ((usize, &TreeColumns), u64)| tree(columns, (number, group), &shape);
        if trees.iter().any(has_sets) {
            notes.push(CATEGORIES.into());
        }
        let mut trees: Vec<Tree> =
            trees.iter().enumerate().zip(tree_info).take(taken).map(read).collect::<Result<_, _>>()?;
        let mut origin = origin(&attributes)?;
        let mut inputs = inputs;
        if let Inputs::Rows(names) = inputs {
            let (features, columns) = columns::features(names, &mut trees, &mut notes)?;
            inputs = Inputs::Rows(features);
            let Rows { mut prediction, mut probability, sentinel } = rows(&attributes, inverse)?;
            prediction.targets = outputs == Kind::One && objects.len() > 1;
            if objective.name == "binary:hinge" {
                probability = Probability::Unknown;
            }
            if sentinel.is_none() {
                notes.push(MISSING_UNKNOWN.into());
            }
            let kind = format!("XGBoost {version} {kind}");
            origin.imported = Some(Imported {
                kind,
                notes,
                prediction,
                probability,
                sentinel,
                columns,
                categories,
                ..Imported::default()
            });
        }
        let mut ensemble = Ensemble { inputs, objects, base_margins, trees, origin };
        if let Some(weights) = weights {
            weigh(&mut ensemble, &weights);
        }
        // Rows may have any number of features, and names; other features and trees were checked above.
        ensemble.check()?;
        Ok(ensemble)
    }
}

/// Number of trees that are taken: those up to the best iteration, if training stopped early and not all are asked for.
fn taken(forest: &Forest, attributes: &Attributes, groups: usize, all: bool, notes: &mut Vec<String>) -> Result<usize> {
    let trees = forest.trees.len();
    let Some(best) = attributes.get("best_iteration") else { return Ok(trees) };
    let best = count("best_iteration", best)?;
    let parallel = count("num_parallel_tree", &forest.gbtree_model_param.num_parallel_tree)?.max(1);
    let is_each = forest.trees.iter().any(|tree| !matches!(tree.tree_param.size_leaf_vector.as_str(), "" | "0" | "1"));
    let per_iteration = if is_each { 1 } else { groups }.saturating_mul(parallel);
    let stated = forest.iteration_indptr.get(best.saturating_add(1)).and_then(|&end| usize::try_from(end).ok());
    let wanted = stated.unwrap_or_else(|| best.saturating_add(1).saturating_mul(per_iteration)).min(trees);
    if wanted == 0 || wanted == trees {
        return Ok(trees);
    }
    if all {
        notes.push(format!(
            "Training stopped early; its best iteration was {best}, with {wanted} trees. All {trees} trees are used, as asked."
        ));
        return Ok(trees);
    }
    notes.push(format!(
        "{STOPPED_EARLY}{wanted} trees up to the best iteration, {best}, are used, as by XGBClassifier and \
         XGBRegressor, and not all {trees}, which Booster.predict uses. Ask for all trees to take those."
    ));
    Ok(wanted)
}

/// Prediction of an ensemble over rows, and the numbers that stand for a missing value.
#[derive(serde::Serialize, serde::Deserialize)]
pub(super) struct StatedRows {
    pub(super) link: String,
    pub(super) last_of_ties: bool,
    pub(super) scale: f32,
    /// Text, since JSON has no infinities.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) sentinel: Option<[String; 2]>,
    /// Divisor of a margin before the link.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub(super) average: u32,
    #[serde(default, skip_serializing_if = "Probability::is_softmax")]
    pub(super) probability: Probability,
}

fn one() -> u32 {
    1
}

fn is_one(number: &u32) -> bool {
    *number == 1
}

#[derive(Default)]
struct Rows {
    prediction: Prediction,
    probability: Probability,
    sentinel: Option<[f32; 2]>,
}

/// Prediction stated by the attribute or the objective.
fn rows(attributes: &Attributes, inverse: Inverse) -> Result<Rows> {
    let name = "palpate_prediction";
    let expected = "a JSON object of link, last_of_ties and scale";
    let Some(text) = attributes.get(name) else {
        return Ok(Rows { prediction: Prediction { link: inverse, ..Prediction::default() }, ..Rows::default() });
    };
    let stated: StatedRows = parsed(name, expected, text)?;
    let wrong = |detail: &str| wrong_attribute(name, expected, detail);
    let link = Inverse::ALL.iter().copied().find(|link| link.name() == stated.link);
    let link = link.ok_or_else(|| wrong(&format!("the link {:?}", stated.link)))?;
    if !(stated.scale.is_finite() && stated.scale > 0.0) {
        return Err(wrong(&format!("the scale {}", stated.scale)));
    }
    let number = |text: &String| text.parse::<f32>().ok().filter(|number| !number.is_nan());
    let sentinel = stated.sentinel.as_ref().map(|ends| ends.each_ref().map(number));
    let sentinel = match sentinel {
        None => None,
        Some([Some(low), Some(high)]) if low <= high => Some([low, high]),
        Some(_) => return Err(wrong("the sentinel is not a range of numbers")),
    };
    if stated.average == 0 {
        return Err(wrong("a mean of no trees"));
    }
    let StatedRows { last_of_ties, scale, average, probability, .. } = stated;
    let prediction = Prediction { link, last_of_ties, scale, targets: false, average };
    Ok(Rows { prediction, probability, sentinel })
}

/// The trees, and the weight of each in a dart booster: up to 3.2 it wraps another booster, then weights stand beside the
/// model, then in it.
fn forest(booster: GradientBooster) -> Result<(Forest, Option<Vec<f32>>)> {
    if !matches!(booster.name.as_str(), "gbtree" | "dart") {
        return Err(without_trees(&booster.name));
    }
    let inner = booster.gbtree.map_or((None, None), |inner| (inner.model, inner.weight_drop));
    let Some(mut forest) = booster.model.or(inner.0) else {
        return Err(problem!("it has settings and no trees, as XGBoost's save_config writes them")
            .fix("Save the model with `booster.save_model(\"model.json\")`."));
    };
    let weights = booster.weight_drop.or(inner.1).or(forest.weight_drop.take());
    // gbtree writes no weights, or none for its trees.
    Ok((forest, weights.filter(|weights| !weights.is_empty())))
}

/// The names of a feature's categories: numbers, or the bytes of all names, and where each begins and ends. None where some are not
/// ASCII: of a pandas table XGBoost 3.2 then counts characters, not bytes.
fn category_names(feature: &serde_json::Value) -> Option<Vec<String>> {
    let list =
        |name: &str| feature.get(name)?.as_array()?.iter().map(serde_json::Value::as_i64).collect::<Option<Vec<_>>>();
    let values = list("values")?;
    let Some(offsets) = list("offsets") else { return Some(values.iter().map(ToString::to_string).collect()) };
    let name = |ends: &[i64]| {
        let bytes = values.get(usize::try_from(ends[0]).ok()?..usize::try_from(ends[1]).ok()?)?;
        bytes.iter().map(|&byte| u8::try_from(byte).ok().filter(u8::is_ascii).map(char::from)).collect()
    };
    offsets.windows(2).map(name).collect()
}

/// Multiplies leaves by their tree's weight, in f32 as XGBoost does.
fn weigh(ensemble: &mut Ensemble, weights: &[f32]) {
    for (tree, weight) in ensemble.trees.iter_mut().zip(weights) {
        for node in &mut tree.nodes {
            if let Node::Leaf(values) = node {
                values.iter_mut().for_each(|value| *value *= weight);
            }
        }
    }
}

/// Another number of classes than the attribute names objects.
fn other_classes(classes: usize, objects: usize) -> Error {
    problem!("it has {classes} classes, but palpate_objects names {objects} objects")
        .fix("Name every class once, in the order of the labels.")
}

fn schema(name: &str, schemas: &[Schema]) -> Result<Schema> {
    let unknown = || {
        let known: Vec<&str> = schemas.iter().map(|schema| schema.name).collect();
        problem!("its descriptor {name:?} is unknown").fix(match known[..] {
            [] => "Read it with the crate that defines the descriptor's features.".into(),
            _ => format!("Use one of {}.", known.join(", ")),
        })
    };
    schemas.iter().find(|schema| schema.name == name).copied().ok_or_else(unknown)
}

fn object_names(attributes: &Attributes) -> Result<Option<Vec<String>>> {
    let name = "palpate_objects";
    let Some(text) = attributes.get(name) else { return Ok(None) };
    let names: Vec<String> = parsed(name, "a JSON array of names", text)?;
    // Over rows there may be one output; otherwise the whole is checked in the end.
    if names.len() != 1 {
        check_names(&names)?;
    }
    Ok(Some(names))
}

/// Facts about the training from the optional attributes.
fn origin(attributes: &Attributes) -> Result<Provenance> {
    let background = attributes.get("palpate_background").map(|text| {
        let expected = "true where the last object is a background, else false";
        parsed("palpate_background", expected, text)
    });
    // What the crate that trained it states, and this one does not read.
    let is_read = |name: &str| READ.contains(&name) || !name.starts_with("palpate_");
    let others = attributes.iter().filter(|(name, _)| !is_read(name));
    Ok(Provenance {
        background: background.transpose()?.unwrap_or_default(),
        imported: None,
        attributes: others.map(|(name, text)| (name.clone(), text.clone())).collect(),
    })
}

/// Attributes that this crate reads.
const READ: [&str; 4] = ["palpate_background", "palpate_descriptor", "palpate_objects", "palpate_prediction"];

fn parsed<'t, T: serde::Deserialize<'t>>(name: &str, expected: &str, text: &'t str) -> Result<T> {
    serde_json::from_str(text).map_err(|error| wrong_attribute(name, expected, error))
}

/// An attribute that does not hold what is expected of it.
fn wrong_attribute(name: &str, expected: &str, detail: impl std::fmt::Display) -> Error {
    problem!("{name} is not {expected}: {detail}")
        .fix("Correct the attribute, or remove it if it is not palpate_objects.")
}

/// A count; XGBoost leaves out some that older versions did not know.
fn count(name: &str, text: &str) -> Result<usize> {
    if text.is_empty() {
        return Ok(0);
    }
    text.parse().map_err(|_| faults::count(name, text))
}

fn base_scores(text: &str, objects: usize) -> Result<Vec<f32>> {
    let list = text.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
    let parsed: Result<Vec<f32>, _> = list.unwrap_or(text).split(',').map(|number| number.trim().parse()).collect();
    match parsed {
        Ok(margins) if margins.iter().any(|margin| !margin.is_finite()) => {}
        Ok(margins) if margins.len() == 1 => return Ok(vec![margins[0]; objects]),
        Ok(margins) if margins.len() == objects => return Ok(margins),
        _ => {}
    }
    Err(problem!("its base_score {text:?} is neither a number nor {objects} numbers, or is not finite").fix(DAMAGED))
}
