//! A small HTTP server with range requests, which can be made to misbehave in the usual ways.
//!
//! In:    the bytes of one file; how to answer, changed at any time.
//! Out:   answers on a port of this machine.
//! Keeps: one thread for each connection, until dropped.
//! Not here: anything that the tests do not ask of it.

use std::io::{BufRead, BufReader, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

/// How to answer.
#[derive(Clone)]
pub struct Behaviour {
    pub bytes: Arc<Vec<u8>>,
    pub etag: Option<&'static str>,
    /// Answers so many requests with `status` first.
    pub failing: u32,
    pub status: u16,
    pub ranges: bool,
    /// States this length where it ignores ranges.
    pub claimed_length: Option<u64>,
    /// Lets the client wait before the header or in the middle of the body.
    pub stall: Option<Stall>,
    /// Closes after half of the body.
    pub cut: bool,
    /// Sends the range this far from where it was asked.
    pub shift: usize,
    /// Requests answered so far.
    pub requests: u32,
    stopping: bool,
}

#[derive(Clone, Copy, PartialEq)]
pub enum Stall {
    Header,
    Body,
}

/// Longer than the time-out of the test that uses it.
const STALL: Duration = Duration::from_millis(600);

/// A connection carries one answer; a client that is not told would use it again.
const EMPTY: &str = "content-length: 0\r\nconnection: close\r\n";

pub struct Server {
    address: SocketAddr,
    behaviour: Arc<Mutex<Behaviour>>,
    thread: Option<JoinHandle<()>>,
}

impl Server {
    pub fn new(bytes: Vec<u8>) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let behaviour = Arc::new(Mutex::new(Behaviour {
            bytes: Arc::new(bytes),
            etag: Some("\"one\""),
            failing: 0,
            status: 500,
            ranges: true,
            claimed_length: None,
            stall: None,
            cut: false,
            shift: 0,
            requests: 0,
            stopping: false,
        }));
        let shared = behaviour.clone();
        let thread = std::thread::spawn(move || listen(&listener, &shared));
        Self { address, behaviour, thread: Some(thread) }
    }

    pub fn url(&self) -> String {
        format!("http://{}/planet.pmtiles", self.address)
    }

    pub fn change(&self, change: impl FnOnce(&mut Behaviour)) {
        change(&mut self.behaviour.lock().unwrap());
    }

    pub fn requests(&self) -> u32 {
        self.behaviour.lock().unwrap().requests
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.change(|it| it.stopping = true);
        let _ = TcpStream::connect(self.address);
        self.thread.take().unwrap().join().unwrap();
    }
}

fn listen(listener: &TcpListener, behaviour: &Arc<Mutex<Behaviour>>) {
    for stream in listener.incoming() {
        if behaviour.lock().unwrap().stopping {
            return;
        }
        let (stream, behaviour) = (stream.unwrap(), behaviour.clone());
        // A client that goes away in the middle is its own business.
        std::thread::spawn(move || answer(stream, &behaviour).unwrap_or_default());
    }
}

/// The first and last byte asked for.
fn asked(stream: &TcpStream) -> std::io::Result<Option<(usize, usize)>> {
    let mut range = None;
    for line in BufReader::new(stream.try_clone()?).lines() {
        let line = line?.to_ascii_lowercase();
        if let Some(bytes) = line.strip_prefix("range: bytes=") {
            let (first, last) = bytes.split_once('-').unwrap();
            range = Some((first.parse().unwrap(), last.parse().unwrap()));
        }
        if line.is_empty() {
            break;
        }
    }
    Ok(range)
}

fn answer(mut stream: TcpStream, behaviour: &Mutex<Behaviour>) -> std::io::Result<()> {
    let range = asked(&stream)?;
    let it = {
        let mut it = behaviour.lock().unwrap();
        it.requests += 1;
        let now = it.clone();
        it.failing = it.failing.saturating_sub(1);
        now
    };
    if it.stall == Some(Stall::Header) {
        std::thread::sleep(STALL);
    }
    if it.failing > 0 {
        return write!(stream, "HTTP/1.1 {} No\r\n{EMPTY}\r\n", it.status);
    }
    let size = it.bytes.len();
    let etag = it.etag.map(|etag| format!("etag: {etag}\r\n")).unwrap_or_default();
    let (status, body) = match range.filter(|_| it.ranges) {
        Some((first, _)) if first >= size => {
            let range = format!("content-range: bytes */{size}\r\n");
            return write!(stream, "HTTP/1.1 416 Beyond\r\n{range}{EMPTY}{etag}\r\n");
        }
        Some((first, last)) => {
            let (first, end) = (first + it.shift, (last + 1).min(size));
            let last = end - 1;
            let status = format!("206 Part\r\ncontent-range: bytes {first}-{last}/{size}");
            (status, &it.bytes[first..end])
        }
        None => ("200 Fine".into(), &it.bytes[..]),
    };
    let length = it.claimed_length.unwrap_or(body.len() as u64);
    write!(
        stream,
        "HTTP/1.1 {status}\r\ncontent-length: {length}\r\nconnection: close\r\n{etag}\r\n"
    )?;
    let half = body.len() / 2;
    stream.write_all(&body[..half])?;
    if it.stall == Some(Stall::Body) {
        std::thread::sleep(STALL);
    }
    if it.cut { Ok(()) } else { stream.write_all(&body[half..]) }
}
