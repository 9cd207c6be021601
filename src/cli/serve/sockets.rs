//! The sockets of `serve`: what came since the last frame, and where a frame goes.
//!
//! In:    an address, ports, whom to answer.
//! Out:   datagrams by link; the address that is answered.
//! Keeps: the open sockets, the last sender of a message.
//! Not here: what datagrams say (`overfly_link`).

use crate::cli::Failure;
use std::io::ErrorKind;
use std::net::{IpAddr, SocketAddr, UdpSocket};

/// No datagram is longer.
const BYTES: usize = 65_536;
/// A frame takes no more than this from a socket; the rest waits in it, or is lost there.
const DATAGRAMS_MAX: u32 = 256;
const BYTES_MAX: usize = 256 << 10;

/// Which protocol.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Link {
    /// CIGI 3.3.
    Cigi,
    /// FlightGear's native FDM.
    NativeFdm,
}

/// What went wrong on the way, as counts.
#[derive(Clone, Copy, Default)]
pub struct Lost {
    /// Datagrams from somebody else than the host that was named.
    pub strangers: u64,
    /// Datagrams that the system did not hand over.
    pub unread: u64,
    /// Messages that could not be sent.
    pub unsent: u64,
}

/// All sockets of a session.
pub struct Sockets {
    cigi: Option<UdpSocket>,
    native_fdm: Option<UdpSocket>,
    /// Only this host is heard and answered.
    reply_to: Option<SocketAddr>,
    /// Who sent the last message.
    last: Option<SocketAddr>,
    buffer: Vec<u8>,
    pub lost: Lost,
}

impl Sockets {
    /// Binds the ports that there are: of CIGI, of FlightGear.
    pub fn bind(
        address: IpAddr,
        [cigi, native_fdm]: [Option<u16>; 2],
        reply_to: Option<SocketAddr>,
    ) -> Result<Self, Failure> {
        let open = |port: u16, option: &str| -> Result<UdpSocket, Failure> {
            let at = SocketAddr::new(address, port);
            let failed = |error| format!("{option}: cannot listen on {at}: {error}");
            let socket = UdpSocket::bind(at).map_err(failed)?;
            socket.set_nonblocking(true).map_err(failed)?;
            Ok(socket)
        };
        Ok(Self {
            cigi: cigi.map(|port| open(port, "--cigi")).transpose()?,
            native_fdm: native_fdm.map(|port| open(port, "--fgfs-native-fdm")).transpose()?,
            reply_to,
            last: None,
            buffer: vec![0; BYTES],
            lost: Lost::default(),
        })
    }

    /// The links, and where they listen.
    pub fn addresses(&self) -> Vec<(&'static str, SocketAddr)> {
        let links = [("CIGI 3.3", &self.cigi), ("FlightGear's native FDM", &self.native_fdm)];
        let bound = |(name, socket): (_, &Option<UdpSocket>)| {
            Some((name, socket.as_ref()?.local_addr().ok()?))
        };
        links.into_iter().filter_map(bound).collect()
    }

    /// Hands over every datagram that came. Where `take` says that one was a message, its sender
    /// is answered from now on.
    pub fn receive(&mut self, mut take: impl FnMut(Link, &[u8]) -> bool) {
        self.drain(Link::Cigi, &mut take);
        self.drain(Link::NativeFdm, &mut take);
    }

    fn drain(&mut self, link: Link, take: &mut impl FnMut(Link, &[u8]) -> bool) {
        let (mut datagrams, mut bytes) = (0, 0);
        while datagrams < DATAGRAMS_MAX && bytes < BYTES_MAX {
            let Some(received) = self.next(link) else { return };
            datagrams += 1;
            let Some((length, from)) = received else { continue };
            bytes += length;
            if take(link, &self.buffer[..length]) && link == Link::Cigi {
                self.last = Some(from);
            }
        }
    }

    /// The next datagram of a link: none is there, or it is lost, or its length and sender.
    fn next(&mut self, link: Link) -> Option<Option<(usize, SocketAddr)>> {
        let socket = match link {
            Link::Cigi => self.cigi.as_ref()?,
            Link::NativeFdm => self.native_fdm.as_ref()?,
        };
        let (length, from) = match socket.recv_from(&mut self.buffer) {
            Ok(received) => received,
            Err(error) if error.kind() == ErrorKind::WouldBlock => return None,
            Err(error) => {
                self.lost.unread += u64::from(error.kind() != ErrorKind::Interrupted);
                return Some(None);
            }
        };
        let wanted = self.reply_to.filter(|_| link == Link::Cigi);
        if wanted.is_some_and(|host| host.ip() != from.ip()) {
            self.lost.strangers += 1;
            return Some(None);
        }
        Some(Some((length, from)))
    }

    /// Sends a message to the host, if there is one. A host that is not there is no fault.
    pub fn send(&mut self, message: &[u8]) {
        let (Some(socket), Some(host)) = (&self.cigi, self.reply_to.or(self.last)) else { return };
        self.lost.unsent += u64::from(socket.send_to(message, host).is_err());
    }
}
