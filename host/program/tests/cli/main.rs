//! The program as its user sees it: one module per group of commands.

mod capture;
mod chip;
mod chip_wire;
mod compiled;
mod data;
mod fit;
mod fixtures;
mod formats;
mod goldens;
mod help;
mod locate;
#[cfg(feature = "mcap")]
mod mcap;
mod mesh;
mod models;
mod newcomer;
mod objects;
mod outputs;
mod parts;
mod plan;
mod play;
mod probe;
mod record;
mod reports;
mod rows;
mod sequences;
mod strangers;
mod support;
mod table;
mod teach;
mod view;

use support::{
    Folder, command, complains, cut, fails, figures, globe, holds, json, lines, listen, listing, normal, palpate,
    parts_are_all_bytes, piped, read, run, says, shapes, stderr, stdout, succeeds, touches,
};
