//! A panic handler that cannot link: an image with it is proof that no code that panics is in it.

#[panic_handler]
#[allow(unsafe_code)]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    unsafe extern "C" {
        /// Defined nowhere.
        fn this_image_can_panic() -> !;
    }
    // SAFETY: never runs; an image that holds this call does not link.
    unsafe { this_image_can_panic() }
}
