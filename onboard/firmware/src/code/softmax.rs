// 6 trees as instructions, beside `softmax.s`. Written by `palpate export`; not to be edited. Features of palpate-onboard: code.
// A module of a crate that allows unsafe code, for a Cortex-M.

core::arch::global_asm!(include_str!("softmax.s"), options(raw));

/// The checksum of the model that was written with it; the names of its functions carry it, so that assembly of another export
/// does not link.
#[allow(dead_code)]
pub const CHECKSUM: u32 = 0xed892af5;

// SAFETY: the assembly reads 4 features, writes 3 margins, and keeps to the calling convention.
unsafe extern "C" {
    /// The margins of a row of f32 values, NaN where one is missing, in units.
    #[link_name = "softmax_margins_ed892af5"]
    pub safe fn softmax_margins(row: &[f32; 4], margins: &mut [i32; 3]);
}

/// This function for the bits of f32 values.
#[allow(clashing_extern_declarations)]
mod bits {
    // SAFETY: as above; an f32 and its bits are the same in memory.
    unsafe extern "C" {
        #[link_name = "softmax_margins_ed892af5"]
        pub(super) safe fn margins(row: &[i32; 4], margins: &mut [i32; 3]);
    }
}

/// The function that [`Model::with_code`](palpate_onboard::Model::with_code) takes.
pub fn margins(row: &[i32], margins: &mut [i32]) {
    if let (Some(row), Some(margins)) = (row.first_chunk(), margins.first_chunk_mut()) {
        bits::margins(row, margins);
    }
}
