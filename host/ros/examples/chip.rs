//! A chip with the household model at a TCP port, to try the node without one: its fingers touch as typed.
//!
//! ```text
//! cargo run --example chip ../../models/household.palpate 127.0.0.1:4000
//! cargo run -- --port tcp://127.0.0.1:4000
//! ```
//!
//! A line of three contact times in seconds (`0.03 0 0.05`; `-` for a finger that does not touch) is a touch of its own
//! fingers. Hosts come one after another, and the chip keeps what it has touched.

use palpate::onboard::shared::link::{Decision, Device, DeviceEnd, Event, TouchMessage};
use palpate::onboard::station::{NoStorage, Station};
use palpate::touches::parse_touch;
use std::error::Error;
use std::io::{ErrorKind, Read, Write};
use std::net::TcpListener;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, model, address] = &arguments[..] else {
        return Err("give a model, and an address such as 127.0.0.1:4000".into());
    };
    let model = std::fs::read(model)?;
    let mut station = Station::<256, NoStorage>::open(&model, NoStorage);
    let mut end = DeviceEnd::new(std::process::id());
    let typed = typed();
    for stream in TcpListener::bind(address)?.incoming() {
        let mut stream = stream?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(Duration::from_millis(10)))?;
        let mut buffer = [0; 64];
        loop {
            // The next host is waited for where the line broke.
            let mut send = |frame: &[u8]| drop(stream.write_all(frame));
            for touch in typed.try_iter() {
                let touch = parse_touch(&touch)?;
                let event = match station.push(&touch, true) {
                    Ok(verdict) => Event::Touch { touch: TouchMessage::from(&touch), pose_age: None, verdict },
                    Err(refusal) => Event::Refused { touch: TouchMessage::from(&touch), refusal },
                };
                if matches!(event, Event::Touch { verdict, .. } if verdict.decision != Decision::Undecided) {
                    let _ = Device::reset(&mut station);
                }
                end.tell(event, &mut send);
            }
            match stream.read(&mut buffer) {
                Ok(0) => break,
                Ok(count) => {
                    end.receive(&buffer[..count], &mut station, |frame| drop(stream.write_all(frame)));
                }
                Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
                Err(_) => break,
            }
        }
    }
    Ok(())
}

/// The lines of standard input.
fn typed() -> Receiver<String> {
    let (send, lines) = channel();
    std::thread::spawn(move || std::io::stdin().lines().map_while(Result::ok).try_for_each(|line| send.send(line)));
    lines
}
