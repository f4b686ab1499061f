//! The program as its user sees it: one module per group of commands.

mod capture;
mod cast;
mod chip;
mod compiled;
mod help;
mod models;
mod reports;
mod support;

use support::{command, globe, json, listing, run, stderr, stdout};
