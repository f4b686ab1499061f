//! Code that all firmware images share.
//!
//! | module | what |
//! |---|---|
//! | [`meter`] | counts instructions and stack, for benchmarks |
//! | [`sections`] | flash and RAM of the running image, by section |
//! | [`uart`] | the UART, received by interrupt |
//! | [`pins`] | three pins that a host plays |
//! | [`identity`] | what every machine must make of a touch |
//! | `located` | the same of a touch with a position, with the feature `locate` |
//! | [`chip`] | the only place with `unsafe`: registers, linker symbols, the stack |
//!
//! Under emulation an image prints through semihosting ([`println!`]) and ends with [`exit`]; a panic or a fault ends
//! the emulator with status 1.
#![no_std]

pub mod chip;
pub mod identity;
#[cfg(feature = "locate")]
pub mod located;
pub mod meter;
pub mod pins;
pub mod sections;
pub mod uart;

pub use cortex_m_semihosting::{hprint as print, hprintln as println};

use cortex_m_semihosting::debug::{self, EXIT_FAILURE, EXIT_SUCCESS};

/// Ends the emulation with status 0.
pub fn exit() -> ! {
    end(EXIT_SUCCESS)
}

/// Ends the emulation with status 1.
pub fn fail() -> ! {
    end(EXIT_FAILURE)
}

fn end(status: debug::ExitStatus) -> ! {
    loop {
        debug::exit(status);
    }
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    println!("{}", info);
    fail()
}
