//! Tests of the public interface, room by room, in one program, which makes what several of them need once.

mod calibrate;
mod capture;
mod compile;
mod ensemble;
mod evaluate;
mod examples;
mod fixtures;
mod invariants;
mod locate;
mod mcap;
mod play;
mod several_meshes;
mod strangers;
mod stream;
mod stroke;
mod teach;
mod train;

#[path = "../../src/tests/repetitions.rs"]
mod repetitions;
#[path = "../../src/tests/shares.rs"]
mod shares;
#[path = "../../src/tests/synthetic.rs"]
mod synthetic;
