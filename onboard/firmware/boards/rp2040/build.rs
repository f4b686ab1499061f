//! Hands memory.x to the linker and the model to the program.

#[path = "../../image.rs"]
mod image;

fn main() -> std::io::Result<()> {
    image::link("memory.x")?;
    image::build_in("../../../../models/household.palpate")
}
