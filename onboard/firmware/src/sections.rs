//! Flash and RAM of the running image, by section, from the linker's own symbols.

use crate::chip;

/// Bytes of each section.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sections {
    /// Vector table and code, in flash.
    pub text: usize,
    /// Constants, in flash.
    pub rodata: usize,
    /// Initialized statics, in RAM; their values are in flash too.
    pub data: usize,
    /// Zeroed statics, in RAM.
    pub bss: usize,
}

impl Sections {
    /// The sections of the running image.
    pub fn of_this_image() -> Self {
        let [text, rodata, data, bss] = chip::section_sizes();
        Self { text, rodata, data, bss }
    }

    /// Bytes of flash in all.
    pub fn flash(&self) -> usize {
        self.text + self.rodata + self.data
    }

    /// Bytes of RAM in all, without the stack.
    pub fn ram(&self) -> usize {
        self.data + self.bss
    }
}
