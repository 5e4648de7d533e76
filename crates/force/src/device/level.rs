//! A level for each finger as datagrams of JSON, for a bridge to a glove with a kit of its own.

use std::net::{SocketAddr, ToSocketAddrs, UdpSocket};

use serde_json::json;

use super::error::DeviceError;
use crate::rendering::PORTS;

/// Sends levels to one address.
#[derive(Debug)]
pub(crate) struct LevelSender {
    socket: UdpSocket,
    to: SocketAddr,
    now_s: f64,
    failed: Option<String>,
}

/// Ticks from datagram to datagram: 100 a second, the rate of the gloves.
const EVERY: u64 = 10;
/// Times that the levels of zero are sent at the end: a datagram may be lost.
const GOODBYES: usize = 3;

/// The text of a datagram: seconds since the beginning of the forces, and the levels, thumb first.
pub fn datagram(now_s: f64, levels: &[f64; PORTS]) -> String {
    let rounded = levels.map(|level| (1e4 * level).round() / 1e4);
    json!({"t": (1e3 * now_s).round() / 1e3, "levels": rounded}).to_string()
}

impl LevelSender {
    pub(super) fn open(address: &str) -> Result<Self, DeviceError> {
        let open = || {
            let mut found = address.to_socket_addrs()?;
            let none = || std::io::Error::other("the host has no address");
            let to = found.next().ok_or_else(none)?;
            let own = if to.is_ipv4() { "0.0.0.0:0" } else { "[::]:0" };
            let socket = UdpSocket::bind(own)?;
            socket.set_nonblocking(true)?;
            Ok((socket, to))
        };
        let (socket, to) = open()
            .map_err(|source| DeviceError::Address { address: address.to_owned(), source })?;
        Ok(Self { socket, to, now_s: 0.0, failed: None })
    }

    pub(super) fn render(&mut self, now_s: f64, tick: u64, levels: [f64; PORTS]) {
        self.now_s = now_s;
        if tick.is_multiple_of(EVERY) {
            self.send(&levels);
        }
    }

    fn send(&mut self, levels: &[f64; PORTS]) {
        let sent = self.socket.send_to(datagram(self.now_s, levels).as_bytes(), self.to);
        if let Err(error) = sent {
            self.failed.get_or_insert_with(|| error.to_string());
        }
    }

    pub(super) fn close(mut self) -> Option<String> {
        (0..GOODBYES).for_each(|_| self.send(&[0.0; PORTS]));
        self.failed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_datagram_is_one_object_of_json() {
        let text = datagram(1.23456, &[0.0, 0.123456, 1.0, 0.5, 0.25]);
        assert_eq!(text, r#"{"levels":[0.0,0.1235,1.0,0.5,0.25],"t":1.235}"#);
    }
}
