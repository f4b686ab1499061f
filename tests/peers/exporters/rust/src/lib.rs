//! Entry points for the harness: `PEER_MODEL` names the file that is built in, `PEER_FEATURES` and `PEER_CLASSES` are
//! numbers.
#![no_std]

const FEATURES: usize = number_in(env!("PEER_FEATURES"));
const CLASSES: usize = number_in(env!("PEER_CLASSES"));

const fn number_in(text: &str) -> usize {
    let (mut number, mut at) = (0, 0);
    while at < text.len() {
        number = 10 * number + (text.as_bytes()[at] - b'0') as usize;
        at += 1;
    }
    number
}

/// The first of the greatest.
fn best<T: PartialOrd + Copy>(margins: &[T]) -> i32 {
    let mut best = 0;
    for (class, margin) in margins.iter().enumerate() {
        if margin.partial_cmp(&margins[best]) == Some(core::cmp::Ordering::Greater) {
            best = class;
        }
    }
    best as i32
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}

#[cfg(feature = "palpate")]
mod peer {
    use super::{CLASSES, FEATURES, best};
    use palpate_onboard::{Model, include_model};

    #[cfg(feature = "real")]
    use palpate_onboard::shared::format::f32_key as key;

    /// A model of whole numbers.
    #[cfg(not(feature = "real"))]
    fn key(value: f32) -> i32 {
        if value.is_nan() { palpate_onboard::shared::MISSING_FEATURE } else { value as i32 }
    }

    static mut MODEL: Option<Model<'static>> = None;

    #[unsafe(no_mangle)]
    extern "C" fn peer_start() -> i32 {
        let Ok(model) = Model::new(include_model!(env!("PEER_MODEL"))) else { return 1 };
        // SAFETY: the harness has one thread, and starts once.
        unsafe { MODEL = Some(model) };
        0
    }

    /// # Safety
    /// `row` has as many values as the model has features.
    #[unsafe(no_mangle)]
    unsafe extern "C" fn peer_class(row: *const f32) -> i32 {
        // SAFETY: see above; nothing else uses the model meanwhile.
        let Some(model) = (unsafe { &*(&raw const MODEL) }) else { return -1 };
        // SAFETY: so says the caller.
        let row = unsafe { core::slice::from_raw_parts(row, FEATURES) };
        let mut features = [0; FEATURES];
        features.iter_mut().zip(row).for_each(|(feature, &value)| *feature = key(value));
        let mut margins = [0; CLASSES];
        model.margins_of(&features, &mut margins);
        best(&margins)
    }
}

#[cfg(feature = "irithyll")]
mod peer {
    use super::{CLASSES, FEATURES, best};
    use irithyll_core::EnsembleView;

    #[repr(align(4))]
    struct Aligned<T: ?Sized>(T);

    /// An ensemble for each class, each after its length; u32.
    static BYTES: &Aligned<[u8]> = &Aligned(*include_bytes!(env!("PEER_MODEL")));
    static mut VIEWS: [Option<EnsembleView<'static>>; CLASSES] = [const { None }; CLASSES];

    fn number(bytes: &'static [u8]) -> (usize, &'static [u8]) {
        match bytes.split_first_chunk() {
            Some((number, rest)) => (u32::from_le_bytes(*number) as usize, rest),
            None => (0, &[]),
        }
    }

    #[unsafe(no_mangle)]
    extern "C" fn peer_start() -> i32 {
        let mut rest: &[u8] = &BYTES.0;
        let mut class = 0;
        while !rest.is_empty() {
            let (length, after) = number(rest);
            let (part, after) = after.split_at(length);
            let Ok(view) = EnsembleView::from_bytes(part) else { return 1 };
            // SAFETY: the harness has one thread, and starts once.
            unsafe { VIEWS[class] = Some(view) };
            class += 1;
            rest = after;
        }
        0
    }

    /// # Safety
    /// `row` has as many values as the ensembles have features.
    #[unsafe(no_mangle)]
    unsafe extern "C" fn peer_class(row: *const f32) -> i32 {
        // SAFETY: so says the caller; nothing else uses the views meanwhile.
        let (row, views) = unsafe { (core::slice::from_raw_parts(row, FEATURES), &*(&raw const VIEWS)) };
        let mut margins = [f32::MIN; CLASSES];
        for (margin, view) in margins.iter_mut().zip(views.iter().flatten()) {
            *margin = view.predict(row);
        }
        best(&margins)
    }
}
