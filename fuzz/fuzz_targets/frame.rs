//! Any bytes on the line, at either end of the link: nothing panics, and a chip executes nothing but the request that it
//! expects. Frames are also made whole first, since hardly any input would pass the checksum.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate_onboard::Model;
use palpate_onboard::station::Station;
use palpate_shared::link::{Decoder, DeviceEnd, HostEnd, HostSettings, VERSION, checksum};

static MODEL: &[u8] = include_bytes!("../../models/household.palpate");

fuzz_target!(|bytes: &[u8]| {
    ends(bytes);
    // Messages of up to 64 bytes, each after a byte that says its length.
    let (mut line, mut rest) = (Vec::new(), bytes);
    while let Some((&length, after)) = rest.split_first() {
        let (message, after) = after.split_at((usize::from(length) % 64).min(after.len()));
        rest = after;
        // The chip is in no session.
        let mut plain = [&[VERSION, 0, 0, 0, 0], message].concat();
        plain.extend(checksum(&plain).to_le_bytes());
        line.extend(cobs(&plain));
    }
    ends(&line);
});

/// Consistent overhead byte stuffing.
fn cobs(plain: &[u8]) -> Vec<u8> {
    let mut frame = vec![0];
    for block in plain.split(|&byte| byte == 0) {
        // No message here is as long as 254 bytes.
        frame.push(block.len() as u8 + 1);
        frame.extend(block);
    }
    frame.push(0);
    frame
}

fn ends(bytes: &[u8]) {
    let mut decoder = Decoder::new();
    let whole = bytes.iter().filter(|&&byte| matches!(decoder.feed(byte), Some(Ok(_)))).count();
    let model = Model::new(MODEL).expect("the model of the repository");
    let (mut station, mut end) = (Station::<16>::new(&model), DeviceEnd::new(1));
    let mut sent = Vec::new();
    end.receive(bytes, &mut station, |frame| sent.extend_from_slice(frame));
    assert_eq!(end.statistics().frames as usize, whole);
    let mut host = HostEnd::new(HostSettings::default());
    host.connect(1, 0, |_| ());
    for bytes in [bytes, &sent] {
        host.receive(bytes, 0, |_| (), |_| ());
        let _ = host.tick(1_000_000, |_| ());
    }
}
