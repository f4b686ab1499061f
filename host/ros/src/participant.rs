//! A participant whose ports are those that it announces.
//!
//! RustDDS 0.15.1 takes another port for its data where the one of its number is taken, but announces its publishers with the
//! taken port: subscribers acknowledge to some other process, and messages lost there are never sent again. This happens where
//! programs of different middlewares start at the same time on one machine, as with `ros2 launch`.

use ros2_client::dds::rustdds::DomainParticipant;
use std::net::{Ipv4Addr, UdpSocket};

/// Numbers that participants on one machine may have.
const NUMBERS: usize = 120;

/// A participant of a domain that has both ports of its number.
///
/// # Errors
/// Reason for a failure, such as that all numbers are taken.
pub(crate) fn join(domain: u16) -> Result<DomainParticipant, String> {
    // Numbers with a port that another process took: held, so that the next participant takes another number.
    let mut held = Vec::new();
    for _ in 0..NUMBERS {
        let participant = DomainParticipant::new(domain).map_err(|error| error.to_string())?;
        // As in the specification of RTPS, "Default Port Numbers".
        let discovery = 7_410 + 250 * domain + 2 * participant.participant_id();
        if is_open_here(discovery + 1) {
            return Ok(participant);
        }
        drop(participant);
        // Where somebody else took it meanwhile, that is as good.
        held.extend(UdpSocket::bind((Ipv4Addr::UNSPECIFIED, discovery)));
    }
    Err(format!("domain {domain}: no two ports are free that belong together"))
}

/// True if this process has a UDP port, and where the system does not say.
#[cfg(target_os = "linux")]
fn is_open_here(port: u16) -> bool {
    use procfs::process::{FDTarget, Process};
    let is_open_here = || -> procfs::ProcResult<bool> {
        let sockets = procfs::net::udp()?;
        let files = Process::myself()?.fd()?;
        let opened: Vec<u64> = (files.flatten())
            .filter_map(|file| if let FDTarget::Socket(inode) = file.target { Some(inode) } else { None })
            .collect();
        Ok(sockets.iter().any(|socket| socket.local_address.port() == port && opened.contains(&socket.inode)))
    };
    is_open_here().unwrap_or(true)
}

#[cfg(not(target_os = "linux"))]
fn is_open_here(_: u16) -> bool {
    true
}
