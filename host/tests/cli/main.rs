//! The program as its user sees it: one module per group of commands.

mod capture;
mod cast;
mod chip;
mod compiled;
mod design;
mod fit;
mod help;
mod mesh;
mod models;
mod objects;
mod plan;
mod probe;
mod record;
mod reports;
mod rows;
mod strangers;
mod support;
mod teach;
mod view;

use support::{command, globe, json, listing, run, stderr, stdout};
