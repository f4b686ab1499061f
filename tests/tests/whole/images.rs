//! Firmware images that link although a panic could not, and take the flash that is stated; of the recognizer alone they hold
//! no float code unless leaves are floats.
//!
//! They are built for chips, so these tests only run where they are asked for:
//! `cargo test --release -p palpate-tests --test whole images:: -- --ignored --nocapture`, which `.ci/firmware` does.

use palpate::compile::{Core, code_flash};
use palpate_tests::chips::{M0, M4F, build};
use palpate_tests::stated::Readme;

/// Tolerance, in percent, of a README's figures under another compiler.
const PERCENT: u64 = 2;

/// Rows of the crate's README, their images, and the features that those have.
const IMAGES: [(&str, &str, &str); 8] = [
    ("verdicts: `compact`, `i8-leaves`", "verdict", "compact,i8-leaves"),
    ("… and posteriors", "posterior", "compact,i8-leaves"),
    ("verdicts: `compact`, `f32-leaves`", "verdict", "compact,f32-leaves"),
    (
        "verdicts: `compact`, `wide`, `i8-leaves`, `i16-leaves`, `strangers`",
        "verdict",
        "compact,wide,i8-leaves,i16-leaves,strangers",
    ),
    ("`effector`: three switches to touches", "effector", "compact,i8-leaves"),
    ("`link`: touches in, verdicts and posteriors out", "link", "compact,i8-leaves"),
    ("`station`: a `ProbeStation` with both, models in flash", "station", "compact,i8-leaves"),
    (
        "`locate`: touches with a position and maps over the link, instead of trees too",
        "table",
        "compact,i8-leaves,locate",
    ),
];

/// Builds an image; of those in `IMAGES` none links if anything in it can panic, since its panic handler calls what is defined
/// nowhere.
fn image(name: &str, target: &str, features: &str) -> Image {
    let path = build(name, target, &["--no-default-features", "--features", features], None);
    let image = Image::read(&std::fs::read(path).expect("the image"));
    println!("{name:9} {target:21} {features:60} {} bytes of flash, {} of RAM", image.flash, image.ram);
    image
}

/// Properties of an ELF file.
struct Image {
    /// Bytes of all sections that are in flash.
    flash: u64,
    /// Bytes of variables; `uart` keeps models and state in memory of its own.
    ram: u64,
    symbols: Vec<String>,
}

impl Image {
    /// Reads a 32-bit little-endian ELF file.
    fn read(elf: &[u8]) -> Self {
        let half = |at: usize| usize::from(u16::from_le_bytes([elf[at], elf[at + 1]]));
        let word = |at: usize| u32::from_le_bytes(elf[at..at + 4].try_into().unwrap()) as usize;
        let text = |at: usize| {
            let name = elf[at..].split(|&byte| byte == 0).next().unwrap_or_default();
            String::from_utf8_lossy(name).into_owned()
        };
        assert_eq!(elf[..6], *b"\x7fELF\x01\x01");
        let sections: Vec<usize> = (0..half(48)).map(|index| word(32) + index * half(46)).collect();
        let names = word(sections[half(50)] + 16);
        let [mut flash, mut ram] = [0; 2];
        let mut symbols = Vec::new();
        for &section in &sections {
            let [kind, flags, start, length, link] = [4, 8, 16, 20, 24].map(|field| word(section + field));
            // PROGBITS and ALLOC.
            flash += if kind == 1 && flags & 2 != 0 { length as u64 } else { 0 };
            let is_variable = matches!(text(names + word(section)).as_str(), ".data" | ".bss" | ".uninit");
            ram += if is_variable { length as u64 } else { 0 };
            // SYMTAB.
            for symbol in (start..start + if kind == 2 { length } else { 0 }).step_by(16) {
                symbols.push(text(word(sections[link] + 16) + word(symbol)));
            }
        }
        Self { flash, ram, symbols }
    }

    fn has(&self, part: &str) -> bool {
        self.symbols.iter().any(|name| name.contains(part))
    }

    /// Symbols of software floating point: the ABI's names, and those of compiler-builtins.
    fn float_code(&self) -> Vec<&String> {
        let abi = ["__aeabi_f", "__aeabi_d", "__aeabi_cf", "__aeabi_cd", "2f", "2d", "sf2", "df2", "sf3", "df3"];
        let of_abi = |name: &str| {
            let (starts, ends) = abi.split_at(4);
            name.starts_with("__")
                && name != "__aeabi_div0"
                && name != "__aeabi_dmb"
                && (starts.iter().any(|start| name.starts_with(start)) || ends.iter().any(|end| name.ends_with(end)))
        };
        self.symbols.iter().filter(|name| of_abi(name) || name.contains("17compiler_builtins5float")).collect()
    }
}

#[test]
#[ignore = "builds firmware: needs the target thumbv6m-none-eabi"]
fn images_cannot_panic_and_hold_no_float_code_and_take_the_flash_that_is_stated() {
    let mut readme = Readme::open("onboard/README.md");
    for (row, name, features) in IMAGES {
        let image = image(name, M0, features);
        assert!(image.has("palpate_onboard"), "the image has no symbols");
        assert!(!image.has("panic"), "{row}: panicking code is linked");
        let is_float = features.contains("f32");
        if ["verdict", "posterior"].contains(&name) && !is_float {
            // 800 bytes, and needed for nothing but moves that can be avoided.
            assert!(!image.has("memcpy"), "{row}: code that copies memory is linked");
            assert_eq!(image.has("evidence5ratio"), name == "posterior", "{row}: the division of a posterior");
            assert_eq!(image.float_code(), Vec::<&String>::new(), "{row}");
        }
        if is_float {
            assert!(image.float_code().iter().any(|name| *name == "__aeabi_fadd"), "{:?}", image.float_code());
        }
        if name == "verdict" {
            let said = code_flash(Core::M0Plus, &features.split(',').collect::<Vec<_>>()) as u64;
            assert!(said.abs_diff(image.flash) * 20 <= image.flash, "{row}: {said} bytes by the estimate");
        }
        readme.cell(row, 1, image.flash, PERCENT);
    }
    readme.finish();
}

#[test]
#[ignore = "builds firmware: needs targets for chips"]
fn the_firmwares_readme_states_the_flash_and_ram_of_its_images() {
    let mut readme = Readme::open("onboard/firmware/README.md");
    for (name, row) in [("uart", "`uart`, no model in it"), ("gpio", "`gpio`, its model included")] {
        let [m4f, m0] = [M4F, M0].map(|target| image(name, target, "default"));
        readme.cell(row, 1, m4f.flash, PERCENT);
        readme.cell(row, 2, m0.flash, PERCENT);
        readme.cell(row, 3, m4f.ram, PERCENT);
        readme.cell(row, 3, m0.ram, PERCENT);
    }
    readme.finish();
}
