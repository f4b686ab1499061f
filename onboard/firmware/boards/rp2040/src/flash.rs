//! The end of the Pico's flash, for records and models.

use crate::shared;
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_write};
use palpate_onboard::station::MappedFlash;

/// End of the program's part; memory.x says the same.
const START: u32 = 512 << 10;
/// The part of the 2 MB that the program leaves.
const LENGTH: usize = 1536 << 10;
/// Address of the flash on the chip's bus.
const MAPPED: usize = 0x1000_0000;
/// Bytes that the flash writes at once; writing ones changes nothing, so a page may be written in parts.
const PAGE: usize = 256;

/// The part of the flash behind the program. There is one.
pub(crate) struct Flash(());

impl Flash {
    /// Takes it, once.
    pub(crate) fn take() -> Option<Self> {
        cortex_m::singleton!(: () = ()).map(|()| Self(()))
    }
}

impl ErrorType for Flash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        let from = self.bytes().get(offset as usize..).and_then(|rest| rest.get(..bytes.len()));
        bytes.copy_from_slice(from.ok_or(NorFlashErrorKind::OutOfBounds)?);
        Ok(())
    }

    fn capacity(&self) -> usize {
        LENGTH
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = 4096;

    #[allow(unsafe_code)]
    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        for sector in (from..to).step_by(Self::ERASE_SIZE) {
            shared::while_nobody_looks(|| {
                // SAFETY: whole sectors behind the program; interrupts are off, the second core does not run, no DMA.
                unsafe { rp2040_flash::flash::flash_range_erase(START + sector, Self::ERASE_SIZE as u32, true) }
            });
        }
        Ok(())
    }

    #[allow(unsafe_code)]
    fn write(&mut self, offset: u32, mut bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        let mut at = offset as usize;
        while !bytes.is_empty() {
            let start = at % PAGE;
            let (now, later) = bytes.split_at(bytes.len().min(PAGE - start));
            // In RAM, since the flash cannot be read while it is written.
            let mut page = [0xff; PAGE];
            page.iter_mut().skip(start).zip(now).for_each(|(to, from)| *to = *from);
            shared::while_nobody_looks(|| {
                // SAFETY: as above; one whole page.
                unsafe { rp2040_flash::flash::flash_range_program(START + (at - start) as u32, &page, true) }
            });
            (at, bytes) = (at + now.len(), later);
        }
        Ok(())
    }
}

impl MappedFlash for Flash {
    #[allow(unsafe_code)]
    fn bytes(&self) -> &[u8] {
        // SAFETY: the flash is there, initialized, and only written through `&mut self`.
        unsafe { core::slice::from_raw_parts((MAPPED + START as usize) as *const u8, LENGTH) }
    }
}
