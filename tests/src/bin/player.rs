//! An emulated chip with three switches, and hands that touch with them: for `.ci/probe`.
//!
//! ```sh
//! player IMAGE HOST:PORT     # the image `gpio`; the address at which `palpate link tcp://HOST:PORT` reaches the chip
//! ```
//!
//! Each line of standard input names a file of touches, which are played on the chip's pins, one approach after the other,
//! by switches that bounce, and a signal at the end of each. The end of standard input ends the chip.

use palpate::touches::text;
use palpate_tests::pins::{APPROACH, Edges, edges};
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;
use std::error::Error;
use std::io::{BufRead, Write};
use std::net::TcpListener;
use std::path::Path;
use std::process::{Command, ExitCode, Stdio};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let played = match arguments.as_slice() {
        [image, address] => play(image, address),
        _ => Err("give an image and an address such as 127.0.0.1:4000".into()),
    };
    match played {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("player: {error}");
            ExitCode::FAILURE
        }
    }
}

fn play(image: &str, address: &str) -> Result<(), Box<dyn Error>> {
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let mut qemu = Command::new("qemu-system-arm");
    qemu.args(["-machine", "mps2-an386", "-display", "none", "-monitor", "none"]);
    qemu.args(["-serial", &format!("tcp:{address},server=on,wait=off")]);
    qemu.args(["-serial", &format!("tcp:{}", listener.local_addr()?)]);
    qemu.args(["-semihosting-config", "enable=on", "-kernel", image]).stdin(Stdio::null());
    let mut chip = qemu.spawn()?;
    let played = (|| {
        let (mut pins, _) = listener.accept()?;
        println!("the chip is at {address}");
        let mut hands = Hands { rng: ChaCha8Rng::seed_from_u64(1), now: 400_000 };
        // The chip tells misses from the first signal on.
        let mut ready = Edges::default();
        ready.over(200_000, 250_000);
        ready.wait(hands.now);
        pins.write_all(&ready.bytes)?;
        for line in std::io::stdin().lock().lines() {
            let line = line?;
            let count = hands.touch(Path::new(line.trim()), &mut pins)?;
            println!("played {count} approaches of {line}");
        }
        Ok(())
    })();
    // It has no end of its own.
    chip.kill()?;
    chip.wait()?;
    played
}

struct Hands {
    rng: ChaCha8Rng,
    /// On the chip's clock.
    now: u32,
}

impl Hands {
    /// Plays every approach of a file; how many there are. Those that miss take their time as well.
    fn touch(&mut self, file: &Path, pins: &mut impl Write) -> Result<usize, Box<dyn Error>> {
        let mut count = 0;
        for touch in text::read(file)? {
            let mut played = Edges::default();
            for (at, finger, closed) in edges(&touch, &mut self.rng) {
                played.edge(finger, closed, self.now.wrapping_add(at));
            }
            let next = self.now.wrapping_add(APPROACH);
            played.over(next.wrapping_sub(60_000), next.wrapping_sub(10_000));
            self.now = next;
            played.wait(self.now);
            pins.write_all(&played.bytes)?;
            count += 1;
        }
        Ok(count)
    }
}
