//! `palpate completions`: the parser's scripts.

use super::Global;
use clap_complete::Shell;
use palpate::Result;
use palpate::output::print;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate completions bash > ~/.local/share/bash-completion/completions/palpate
  palpate completions zsh > \"${fpath[1]}/_palpate\"
  palpate completions fish > ~/.config/fish/completions/palpate.fish")]
pub(crate) struct Arguments {
    /// The shell that will read the script
    shell: Shell,
}

pub(crate) fn run(arguments: Arguments, _: &Global) -> Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut super::cli(), "palpate", &mut script);
    print(&String::from_utf8_lossy(&script))
}
