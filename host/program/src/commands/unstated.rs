//! Facts that a file of another library does not state, from the command line.

use palpate::ensemble::import::Options;

#[derive(clap::Args)]
pub(super) struct UnstatedArguments {
    /// The number that stood for a missing value in training, such as 0
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    missing: Option<f32>,
    /// Take all trees, not those up to the best iteration
    #[arg(long)]
    all_trees: bool,
}

impl UnstatedArguments {
    pub(super) fn options<'a>(&self, names: Option<&'a [String]>) -> Options<'a> {
        Options { names, all_trees: self.all_trees, missing: self.missing, ..Options::default() }
    }
}
