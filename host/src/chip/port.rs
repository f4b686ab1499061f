//! Where a chip can be reached.

use super::{Emulator, Transport};
use crate::error::{Error, Result};
use std::fmt;
use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::str::FromStr;
use std::time::Duration;

/// Where a chip can be reached.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Port {
    /// A serial port, by the operating system's name: `/dev/ttyACM0`, `COM3`.
    Serial(String),
    /// `tcp://host:port`: whatever passes bytes on, such as a serial server or an emulator elsewhere.
    Tcp(String),
    /// `emulator`: an emulator that is started for this.
    Emulator,
}

impl FromStr for Port {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once("://") {
            Some(("tcp", address)) if address.contains(':') => Ok(Self::Tcp(address.into())),
            Some(_) => Err("not a port: give a serial port, tcp://host:port or emulator".into()),
            None if text == "emulator" => Ok(Self::Emulator),
            None => Ok(Self::Serial(text.into())),
        }
    }
}

impl fmt::Display for Port {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Serial(name) => f.write_str(name),
            Self::Tcp(address) => write!(f, "tcp://{address}"),
            Self::Emulator => f.write_str("emulator"),
        }
    }
}

impl Port {
    /// Opens the port; `baud` is the speed of a serial one, `emulator` what to start.
    ///
    /// # Errors
    /// When the port cannot be opened or the emulator not be started.
    pub fn open(&self, baud: u32, emulator: &Emulator) -> Result<Transport> {
        match self {
            Self::Serial(name) => open_serial(name, baud),
            Self::Tcp(address) => {
                let io = |source| Error::io(self.to_string(), "connect to the chip", source);
                let stream = TcpStream::connect(address).map_err(io)?;
                stream.set_nodelay(true).map_err(io)?;
                let reader = stream.try_clone().map_err(io)?;
                Ok(Transport::new(self.to_string(), reader, TcpWriter(stream), Duration::ZERO))
            }
            Self::Emulator => emulator.start(),
        }
    }
}

fn open_serial(name: &str, baud: u32) -> Result<Transport> {
    let wrong = |error: serialport::Error| {
        let ports = serialport::available_ports().unwrap_or_default();
        let names: Vec<String> = ports.into_iter().map(|port| port.port_name).collect();
        let there = if names.is_empty() { "No serial port is there".into() } else { names.join(", ") };
        let fix = format!("Serial ports here: {there}. Check the cable, and that no other program has the port.");
        Error::file(name, format!("cannot open the serial port: {error}"), fix)
    };
    let port = serialport::new(name, baud).timeout(Duration::from_millis(100)).open().map_err(wrong)?;
    let reader = port.try_clone().map_err(wrong)?;
    Ok(Transport::new(name.into(), Patient(reader), SerialWriter(port), Duration::ZERO))
}

/// Hangs up when it is dropped: the thread that reads has the stream open too, and waits in it.
struct TcpWriter(TcpStream);

impl Drop for TcpWriter {
    fn drop(&mut self) {
        let _ = self.0.shutdown(Shutdown::Both);
    }
}

impl Write for TcpWriter {
    fn write(&mut self, buffer: &[u8]) -> std::io::Result<usize> {
        self.0.write(buffer)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.0.flush()
    }
}

/// A serial port that is quiet has nothing to read yet; it has not failed.
struct Patient(Box<dyn serialport::SerialPort>);

impl Read for Patient {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        loop {
            match self.0.read(buffer) {
                Err(error) if error.kind() == ErrorKind::TimedOut => {}
                result => return result,
            }
        }
    }
}

struct SerialWriter(Box<dyn serialport::SerialPort>);

impl Write for SerialWriter {
    fn write(&mut self, buffer: &[u8]) -> std::io::Result<usize> {
        loop {
            match self.0.write(buffer) {
                // The line is slower than we are.
                Err(error) if error.kind() == ErrorKind::TimedOut => {}
                result => return result,
            }
        }
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.0.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ports_are_told_apart_by_how_they_are_written() {
        let port = |text: &str| text.parse::<Port>();
        assert_eq!(port("emulator"), Ok(Port::Emulator));
        assert_eq!(port("tcp://localhost:4000"), Ok(Port::Tcp("localhost:4000".into())));
        assert_eq!(port("/dev/ttyACM0"), Ok(Port::Serial("/dev/ttyACM0".into())));
        assert!(port("http://localhost").is_err() && port("tcp://localhost").is_err());
    }

    #[test]
    fn a_dropped_transport_hangs_up() {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let port = Port::Tcp(listener.local_addr().unwrap().to_string());
        let transport = port.open(115_200, &Emulator::default()).unwrap();
        let (mut chip, _) = listener.accept().unwrap();
        chip.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        drop(transport);
        assert_eq!(chip.read(&mut [0]).unwrap(), 0);
    }

    #[test]
    fn a_serial_port_that_is_not_there_is_named() {
        let error = Port::Serial("/dev/no-such-port".into()).open(115_200, &Emulator::default()).err().unwrap();
        assert!(error.to_string().starts_with("/dev/no-such-port: cannot open the serial port"), "{error}");
    }
}
