//! Objects on a table are located here with the same bits as on the machine that wrote `located.bin` (`cargo run --release -p
//! palpate-tests --bin located -- write=DIRECTORY`), and what an approach costs.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use palpate_firmware::located::{self, Found, LENGTH, OnChip, TERMS, TOUCH, Terms};
use palpate_firmware::meter::{self, Meter};
use palpate_firmware::sections::Sections;
use palpate_firmware::{exit, fail, println};
use palpate_onboard::Verdict;
use palpate_onboard::locate::{Hand, Locator, Maps};

const MODEL: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/bench/located.palpate"));
const APPROACHES: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/bench/located.bin"));
/// Start of the stack: the end of the RAM in `mps2.x`.
const STACK: u32 = 0x2004_0000;
/// Approaches whose results are printed.
const PRINTED: u32 = 12;

#[entry]
fn main() -> ! {
    let Some((terms, approaches)) = APPROACHES.split_first_chunk::<TERMS>() else {
        println!("located SKIPPED: PALPATE_BENCH names no directory that located wrote");
        exit();
    };
    let terms = Terms::from_bytes(terms);
    let Ok(maps) = Maps::new(MODEL) else { fail() };
    let (Some(hand), Some(peripherals)) = (Hand::of(&maps), cortex_m::Peripherals::take()) else { fail() };
    let Ok(fitting) = maps.try_into() else { fail() };
    let locator = &mut OnChip::new(fitting, maps.stopping(), terms.effort, 1);
    let mut meter = Meter::new(peripherals.SYST);
    let (mut count, mut named, mut different, mut all, mut most, mut stack) = (0, 0, 0, 0, 0, 0);
    for approach in approaches.as_chunks::<{ TOUCH + LENGTH }>().0 {
        let Some((touch, expected)) = approach.split_first_chunk::<TOUCH>() else { fail() };
        let touch = located::touch(touch);
        let mut result = None;
        let mut instructions = 0;
        let used = meter::stack(|| {
            let push = || located::push(locator, &touch, hand, &terms);
            (result, instructions) = meter.once(push);
        });
        let Some(found) = result else { fail() };
        count += 1;
        all += instructions;
        (most, stack) = (u64::max(most, instructions), usize::max(stack, used));
        different += u32::from(located::record(locator, &found) != *expected);
        if count <= PRINTED {
            print(&maps, &found, instructions);
        }
        if found.verdict != Some(Verdict::Undecided) {
            named += u32::from(matches!(found.verdict, Some(Verdict::Recognized { .. })));
            locator.reset();
        }
    }
    println!("{} approaches, {} names: {} differ from the host's", count, named, different);
    println!(
        "an approach with the choice of the next: {} instructions, at most {}",
        all / u64::from(count.max(1)),
        most
    );
    println!(
        "the maps: {} bytes of flash; code, with that of this image: {}",
        MODEL.len(),
        Sections::of_this_image().text
    );
    let frame = STACK.saturating_sub(cortex_m::register::msp::read());
    println!(
        "the locator: {} bytes of RAM, {} with 64 KB of cells, {} with 32 KB; the stack with it {}, and {} in an approach",
        size_of::<OnChip>(),
        size_of::<Locator<8_192, 32, 16>>(),
        size_of::<Locator<4_096, 32, 16>>(),
        frame,
        stack,
    );
    if different == 0 && count > 0 { exit() } else { fail() }
}

fn print(maps: &Maps<'_>, found: &Found, instructions: u64) {
    let next = found.next;
    match found.verdict {
        Some(Verdict::Recognized { object, touches, .. }) => {
            println!("{} after {} approaches", maps.object_name(object.into()), touches)
        }
        other => println!("{:?}, next at {} {} um, roll {}/256", other, next.x, next.y, next.roll),
    }
    if let Some(pose) = found.pose {
        let [[x, y], [x_within, y_within]] = [pose.position, pose.within.map(u32::cast_signed)];
        println!(
            "    {} {}: {} +- {} um, {} +- {} um, yaw {:?}/65536; {} instructions",
            maps.object_name(maps.object_of(pose.placement).into()),
            maps.placement_name(pose.placement),
            x,
            x_within,
            y,
            y_within,
            pose.yaw_within.map(|within| (pose.yaw, within)),
            instructions
        );
    }
}
