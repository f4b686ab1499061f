//! Problems with ensembles and their files.

use crate::error::Variant;

/// Problems with ensembles and their files.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EnsembleProblem {
    /// The file is of a kind, or has something in it, that cannot be read.
    #[error("{what}")]
    Unsupported {
        /// Description of the file's kind or content.
        what: String,
        /// The way round, as a sentence.
        way: String,
    },
    /// A file of another library contradicts itself.
    #[error("not a whole model in the format {kind}: {what}")]
    Damaged {
        /// The format.
        kind: &'static str,
        /// Description of the fault.
        what: String,
    },
    /// There are too few or too many features.
    #[error("its trees use {used} of its {count} features, and not 1 to {most}")]
    FeatureCount {
        /// Features.
        count: usize,
        /// Features that some tree splits on.
        used: usize,
        /// The most that there may be.
        most: usize,
    },
    /// A name that no feature can have.
    #[error("the feature's name {name:?} is longer than 255 bytes or has a control character in it")]
    FeatureName {
        /// The name.
        name: String,
    },
    /// There are other names than outputs.
    #[error("{names} names were given for {outputs} outputs")]
    Names {
        /// Names.
        names: usize,
        /// Objects (classes), or the one output of a regression.
        outputs: usize,
    },
    /// A file is not JSON, or not of XGBoost's schema.
    #[error("not an ensemble in XGBoost's JSON format: {detail}")]
    NotJson {
        /// The parser's message.
        detail: String,
    },
    /// The objective is not one whose margins are known.
    #[error("its objective is {found}")]
    Objective {
        /// The objective found.
        found: String,
        /// Name of what it is over, if the model computes its features.
        of: Option<&'static str>,
    },
    /// The booster has no trees.
    #[error("its booster is {found}, which has no trees")]
    Booster {
        /// The booster found.
        found: String,
    },
    /// An attribute is missing.
    #[error("it has no attribute {name}")]
    NoAttribute {
        /// Its name.
        name: &'static str,
        /// A value in Python that it could have.
        example: &'static str,
    },
    /// An attribute has an invalid value.
    #[error("{name} is not {expected}: {detail}")]
    Attribute {
        /// Its name.
        name: &'static str,
        /// Content that was expected.
        expected: &'static str,
        /// The parser's message.
        detail: String,
    },
    /// The schema of its features is not one of those that were given.
    #[error("its descriptor {found:?} is unknown")]
    UnknownDescriptor {
        /// Its name.
        found: String,
        /// Names of those that were given.
        known: Vec<&'static str>,
    },
    /// Too few objects, or too many.
    #[error("it names {count} objects")]
    ObjectCount {
        /// Number of objects.
        count: usize,
    },
    /// A name that no object can have.
    #[error("{}", bad_name(name, *why))]
    ObjectName {
        /// The name.
        name: String,
        /// The reason.
        why: NameProblem,
    },
    /// There are other classes than objects.
    #[error("it has {classes} classes, but palpate_objects names {objects} objects")]
    Classes {
        /// Classes in the file.
        classes: usize,
        /// Objects that the attribute names.
        objects: usize,
    },
    /// There are other features than the schema has.
    #[error("it has {found} features, but its descriptor {name} has {} ({})", features.len(), features.join(", "))]
    Features {
        /// Features in the file.
        found: usize,
        /// Name of the schema that the file states.
        name: &'static str,
        /// Features of the schema.
        features: &'static [&'static str],
    },
    /// The base score cannot be used.
    #[error("its base_score {text:?} is neither a number nor {objects} numbers, or is not finite")]
    BaseScore {
        /// The base score.
        text: String,
        /// Number of objects.
        objects: usize,
    },
    /// There is no margin to start from for each object.
    #[error("it has {found} finite base margins for {objects} objects")]
    BaseMargins {
        /// Finite base margins.
        found: usize,
        /// Objects.
        objects: usize,
    },
    /// There are no trees.
    #[error("it has no trees")]
    NoTrees,
    /// A list of XGBoost's has another length than there are trees.
    #[error("tree_info has {found} entries for {trees} trees")]
    TreeInfo {
        /// Entries.
        found: usize,
        /// Trees.
        trees: usize,
    },
    /// There are other weights of a dart booster than trees.
    #[error("weight_drop has {found} entries for {trees} trees")]
    WeightDrop {
        /// Entries.
        found: usize,
        /// Trees.
        trees: usize,
    },
    /// A number is written as something else.
    #[error("{name} is {text:?}, not a count")]
    Count {
        /// The field.
        name: &'static str,
        /// Text that it holds.
        text: String,
    },
    /// A tree contradicts itself.
    #[error("tree {tree}: {problem}")]
    Tree {
        /// The tree, counted from 0.
        tree: usize,
        /// Description of the fault.
        problem: TreeProblem,
    },
}

/// Reason why a name cannot be an object's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum NameProblem {
    /// It is empty.
    Empty,
    /// It has a control character.
    Control,
    /// It has more than 255 bytes.
    Long,
    /// Another object has it.
    Twice,
}

/// Problems with a tree. Nodes are counted from 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TreeProblem {
    /// There is not even a root.
    #[error("it has no nodes")]
    NoNodes,
    /// A column of the file does not have one entry for each node.
    #[error("{column} has {found} entries instead of {wanted}")]
    Column {
        /// The column.
        column: &'static str,
        /// Its entries.
        found: usize,
        /// Nodes.
        wanted: usize,
    },
    /// A number is written as something else.
    #[error("{name} is {text:?}, not a count")]
    Count {
        /// The field.
        name: &'static str,
        /// Text that it holds.
        text: String,
    },
    /// Splits by category.
    #[error("it splits on categories of the feature {feature}")]
    Categorical {
        /// The feature's name.
        feature: String,
    },
    /// It adds to an object that does not exist.
    #[error("it is for object {object} of {objects}")]
    Object {
        /// The object, counted from 0.
        object: u64,
        /// Objects.
        objects: usize,
    },
    /// Its leaves hold another number of values than there are objects.
    #[error("its leaves hold {values} values for {objects} objects")]
    LeafWidth {
        /// Values of each leaf.
        values: usize,
        /// Objects.
        objects: usize,
    },
    /// A child does not exist.
    #[error("node {node}: its {side} child {child} is not one of {nodes} nodes")]
    Child {
        /// The node.
        node: usize,
        /// Left or right.
        side: &'static str,
        /// The child.
        child: i64,
        /// Nodes.
        nodes: usize,
    },
    /// A node has two parents, or is its own ancestor.
    #[error("node {node} is reached twice: the tree has a cycle or a shared branch")]
    ReachedTwice {
        /// The node.
        node: usize,
    },
    /// There are too many splits one below the other.
    #[error("it is deeper than {most} splits")]
    TooDeep {
        /// The most that there may be.
        most: usize,
    },
    /// A split is at a feature that does not exist.
    #[error("node {node}: it splits on feature {feature}, but there are {features}")]
    Feature {
        /// The node.
        node: usize,
        /// The feature, counted from 0.
        feature: u64,
        /// Features.
        features: usize,
    },
    /// A threshold is not a number.
    #[error("node {node}: its threshold {threshold} is not finite")]
    Threshold {
        /// The node.
        node: usize,
        /// The threshold.
        threshold: f32,
    },
    /// A leaf's values are not in the file.
    #[error("node {node}: {column} has no {values} values for this leaf")]
    NoValues {
        /// The leaf.
        node: usize,
        /// Their expected column.
        column: &'static str,
        /// Number of values there should be.
        values: usize,
    },
    /// A leaf has another number of values than the tree's others.
    #[error("leaf {node} has {found} values instead of {wanted}")]
    LeafValues {
        /// The leaf.
        node: usize,
        /// Its values.
        found: usize,
        /// Output that the tree asks for.
        wanted: usize,
    },
    /// A leaf's value cannot be added.
    #[error("leaf {node} has the value {value}, which is not finite")]
    LeafValue {
        /// The leaf.
        node: usize,
        /// The value.
        value: f32,
    },
}

fn bad_name(name: &str, why: NameProblem) -> String {
    match why {
        NameProblem::Empty => "an object has an empty name".into(),
        NameProblem::Control => format!("the object's name {name:?} has a control character in it"),
        NameProblem::Long => format!("the object's name {name:?} has more than 255 bytes"),
        NameProblem::Twice => format!("it has the object {name:?} twice"),
    }
}

impl Variant for EnsembleProblem {
    fn fix(&self) -> String {
        match self {
            Self::Unsupported { way, .. } => way.clone(),
            Self::Damaged { .. } => "Save the model again with the library that trained it.".into(),
            Self::FeatureCount { most, .. } => format!("Train on the features that matter, at most {most}."),
            Self::FeatureName { .. } => "Give the feature a shorter name before training.".into(),
            Self::Names { .. } => "Give one name for each class, in the order of the labels.".into(),
            Self::NotJson { .. } => {
                "Give a file that `palpate train` or XGBoost's `save_model(\"….json\")` wrote.".into()
            }
            Self::Objective { of, .. } => {
                let only = of.map_or_else(String::new, |of| format!("; a model of {of} with multi:softprob"));
                format!("Train with multi:softprob, binary:logistic or a regression of one target{only}.")
            }
            Self::Booster { .. } => "Train with booster=gbtree or dart.".into(),
            Self::NoAttribute { name, example } => {
                format!("Before saving it in Python, set it: `booster.set_attr({name}={example})`.")
            }
            Self::Attribute { .. } => "Correct the attribute, or remove it if it is not palpate_objects.".into(),
            Self::UnknownDescriptor { known, .. } if known.is_empty() => {
                "Read it with the crate that defines the descriptor's features.".into()
            }
            Self::UnknownDescriptor { known, .. } => format!("Use one of {}.", known.join(", ")),
            Self::ObjectCount { .. } | Self::ObjectName { .. } => {
                "Use 2 to 256 different names of at most 255 bytes, without tabs and line ends.".into()
            }
            Self::Classes { .. } => "Name every class once, in the order of the labels.".into(),
            Self::Features { .. } => "Train it on that descriptor's features, or name the right descriptor.".into(),
            Self::Tree { problem: TreeProblem::Categorical { .. }, .. } => {
                "Encode categories as numbers before training, one column of 0 and 1 for each (one-hot).".into()
            }
            Self::BaseScore { .. }
            | Self::BaseMargins { .. }
            | Self::NoTrees
            | Self::TreeInfo { .. }
            | Self::WeightDrop { .. }
            | Self::Count { .. }
            | Self::Tree { .. } => "The ensemble is damaged or was changed by hand; train or export it again.".into(),
        }
    }
}
