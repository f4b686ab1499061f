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
    let mut cli = super::cli();
    clap_complete::generate(arguments.shell, &mut cli, "palpate", &mut script);
    let script = String::from_utf8_lossy(&script);
    let script = super::keys::completed(&script, arguments.shell);
    if arguments.shell != Shell::Fish {
        return print(&script);
    }
    // For fish the generator also offers what help does not list.
    let hidden: Vec<String> = hidden(&cli).iter().map(|name| format!("-a \"{name}\"")).collect();
    let lines = script.lines().filter(|line| !hidden.iter().any(|name| line.contains(name)));
    print(&lines.map(|line| format!("{line}\n")).collect::<String>())
}

/// The names of the commands that help does not list.
fn hidden(command: &clap::Command) -> Vec<&str> {
    let own = command.get_subcommands().filter(|own| own.is_hide_set()).map(clap::Command::get_name);
    own.chain(command.get_subcommands().flat_map(hidden)).collect()
}
