//! Models of other libraries and of one's own, as they are imported, compiled, proved and called.

mod by_hand;
mod calls;
mod compiling;
mod fixtures;
mod import;
mod legend;
mod objectives;
mod rows;
#[path = "../../../../tests/data/import/table.rs"]
mod table;
mod values;
