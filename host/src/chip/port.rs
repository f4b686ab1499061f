//! Address of a chip.

use super::{Emulator, Transport};
use crate::error::{Error, Kind, Place, Result, problem};
use std::fmt;
use std::io::Write;
use std::net::{Shutdown, TcpStream};
use std::str::FromStr;
use std::time::Duration;

/// Address of a chip.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Port {
    /// A serial port, by the operating system's name: `/dev/ttyACM0`, `COM3`.
    Serial(String),
    /// `tcp://host:port`: anything that passes bytes on, such as a serial server or an emulator elsewhere.
    Tcp(String),
    /// `emulator`: an emulator that is started for this.
    Emulator,
}

impl FromStr for Port {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text.split_once("://") {
            Some(("tcp", address)) if address.contains(':') => Ok(Self::Tcp(address.into())),
            Some(_) => Err(problem!("`{text}` is not a port").fix("Give a serial port, tcp://HOST:PORT or emulator.")),
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
    /// Opens the port; `baud` is the speed of a serial one in bits per second, `emulator` what to start.
    ///
    /// # Errors
    /// When the port cannot be opened, the emulator cannot be started, or the port is a serial one and this build has no feature
    /// `serial`.
    pub fn open(&self, baud: u32, emulator: &Emulator) -> Result<Transport> {
        match self {
            Self::Serial(name) => serial::open(name, baud),
            Self::Tcp(address) => {
                let io = |source: std::io::Error| {
                    problem!("cannot connect to the chip: {source}")
                        .fix("Check the address, and that a program serves the chip there.")
                        .as_kind(Kind::Lost)
                        .at(Place::file(self.to_string()))
                };
                let stream = TcpStream::connect(address).map_err(io)?;
                stream.set_nodelay(true).map_err(io)?;
                let reader = stream.try_clone().map_err(io)?;
                Ok(Transport::new(self.to_string(), reader, TcpWriter(stream), Duration::ZERO))
            }
            Self::Emulator => emulator.start(),
        }
    }
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

#[cfg(feature = "serial")]
mod serial {
    use super::super::Transport;
    use crate::error::{Kind, Place, Result, problem};
    use serialport::SerialPort;
    use std::io::{ErrorKind, Read, Write};
    use std::time::Duration;

    pub(super) fn open(name: &str, baud: u32) -> Result<Transport> {
        let wrong = |error: serialport::Error| {
            let ports = serialport::available_ports().unwrap_or_default();
            let ports: Vec<String> = ports.into_iter().map(|port| port.port_name).collect();
            let ports = match ports.as_slice() {
                [] => "This machine has no serial port".to_owned(),
                ports => format!("Serial ports of this machine: {}", ports.join(", ")),
            };
            problem!("cannot open the serial port: {error}")
                .fix(format!("{ports}. Check the cable, and that no other program has the port open."))
                .as_kind(Kind::Lost)
                .at(Place::file(name))
        };
        let port = serialport::new(name, baud).timeout(Duration::from_millis(100)).open().map_err(wrong)?;
        let reader = port.try_clone().map_err(wrong)?;
        Ok(Transport::new(name.into(), Patient(reader), Patient(port), Duration::ZERO))
    }

    /// A serial port that is quiet, or slower than this program, has not failed: it is asked again.
    struct Patient(Box<dyn SerialPort>);

    impl Read for Patient {
        fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
            retry(|| self.0.read(buffer))
        }
    }

    impl Write for Patient {
        fn write(&mut self, buffer: &[u8]) -> std::io::Result<usize> {
            retry(|| self.0.write(buffer))
        }

        fn flush(&mut self) -> std::io::Result<()> {
            self.0.flush()
        }
    }

    fn retry(mut action: impl FnMut() -> std::io::Result<usize>) -> std::io::Result<usize> {
        loop {
            match action() {
                Err(error) if error.kind() == ErrorKind::TimedOut => {}
                result => return result,
            }
        }
    }
}

#[cfg(not(feature = "serial"))]
mod serial {
    use super::super::Transport;
    use crate::error::{Place, Result, problem};

    pub(super) fn open(name: &str, _: u32) -> Result<Transport> {
        Err(problem!("this build of Palpate has no serial ports")
            .fix("Build it with the feature `serial`, or reach the chip through tcp://HOST:PORT.")
            .at(Place::file(name)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    #[test]
    fn ports_are_distinguished_by_how_they_are_written() {
        let port = |text: &str| text.parse::<Port>();
        assert_eq!(port("emulator").unwrap(), Port::Emulator);
        assert_eq!(port("tcp://localhost:4000").unwrap(), Port::Tcp("localhost:4000".into()));
        assert_eq!(port("/dev/ttyACM0").unwrap(), Port::Serial("/dev/ttyACM0".into()));
        assert!(port("http://localhost").is_err() && port("tcp://localhost").is_err());
        let error = port("http://localhost").unwrap_err().to_string();
        assert_eq!(error, "`http://localhost` is not a port. Give a serial port, tcp://HOST:PORT or emulator.");
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

    #[cfg(feature = "serial")]
    #[test]
    fn a_serial_port_that_does_not_exist_is_named() {
        let error = Port::Serial("/dev/no-such-port".into()).open(115_200, &Emulator::default()).err().unwrap();
        assert!(error.to_string().starts_with("/dev/no-such-port: cannot open the serial port"), "{error}");
    }

    #[cfg(not(feature = "serial"))]
    #[test]
    fn without_serial_ports_the_missing_feature_is_named() {
        let error = Port::Serial("/dev/ttyACM0".into()).open(115_200, &Emulator::default()).err().unwrap();
        assert!(error.to_string().contains("feature `serial`"), "{error}");
    }
}
