//! An archive on an http(s) server, by range requests.
//!
//! In:    offset and length.
//! Out:   the bytes, after as many tries as allowed; or why there are none.
//! Keeps: connections, what the server said about the archive, whether it is worth asking.
//! Not here: what the bytes mean; threads (a request blocks its caller, a loader thread).

use crate::OpenOptions;
use crate::breaker::Breaker;
use crate::fault::ArchiveFault;
use bytes::Bytes;
use overfly_jobs::now_ns;
use parking_lot::Mutex;
use std::io::Read;
use std::sync::OnceLock;
use std::time::Duration;
use ureq::http::{HeaderMap, Response};
use ureq::{Agent, Body, Error};

/// An archive of a server without range requests is fetched as a whole up to this size.
const WHOLE_BYTES_MAX: u64 = 16 << 20;
/// A retry that waits looks so often whether the archive was closed.
const NAP: Duration = Duration::from_millis(20);
const REDIRECTS_MAX: u32 = 4;

/// The server side of one archive.
pub(crate) struct Server {
    url: String,
    agent: Agent,
    retries: u32,
    backoff: Duration,
    pub(crate) breaker: Breaker,
    /// What the first answer said.
    seen: Mutex<Option<Seen>>,
    /// The whole archive, where the server ignores ranges.
    whole: OnceLock<Bytes>,
}

/// What tells one state of a remote file from another.
#[derive(Clone, PartialEq, Debug)]
struct Seen {
    size: Option<u64>,
    version: Option<String>,
}

/// Why one request gave nothing.
enum Trouble {
    /// The next try may do better.
    Passing(String),
    Final(ArchiveFault),
}

fn refused(what: impl Into<String>) -> Trouble {
    Trouble::Final(ArchiveFault::Server(what.into()))
}

impl Server {
    pub(crate) fn new(url: &str, options: &OpenOptions) -> Self {
        let (connect, read) = (options.connect_timeout, options.read_timeout);
        let mut config = Agent::config_builder()
            .http_status_as_error(false)
            .max_redirects(REDIRECTS_MAX)
            .user_agent(concat!("overfly/", env!("CARGO_PKG_VERSION")))
            .accept_encoding("identity")
            .timeout_resolve(Some(connect))
            .timeout_connect(Some(connect))
            .timeout_per_read(Some(read))
            .timeout_per_write(Some(read))
            // However slowly it drips: a request ends.
            .timeout_global(Some((connect + read).saturating_mul(4)));
        if is_local(url) {
            config = config.proxy(None);
        }
        Self {
            url: url.to_owned(),
            agent: config.build().new_agent(),
            retries: options.retries,
            backoff: options.backoff,
            breaker: Breaker::new(options.failures_max, options.cool_down),
            seen: Mutex::default(),
            whole: OnceLock::new(),
        }
    }

    /// Size of the archive, once the server has told.
    pub(crate) fn size(&self) -> Option<u64> {
        self.seen.lock().as_ref().and_then(|seen| seen.size)
    }

    /// Up to `length` bytes, fewer only at the archive's end.
    pub(crate) fn read(&self, offset: u64, length: usize) -> Result<Bytes, ArchiveFault> {
        if let Some(whole) = self.whole.get() {
            return slice(whole, offset, length);
        }
        self.breaker.admit(now_ns())?;
        let outcome = self.attempts(offset, length);
        match &outcome {
            Ok(_) => self.breaker.succeeded(),
            Err(fault) => self.breaker.failed(now_ns(), &fault.to_string()),
        }
        outcome
    }

    fn attempts(&self, offset: u64, length: usize) -> Result<Bytes, ArchiveFault> {
        let mut wait = self.backoff;
        for attempt in 0_u32.. {
            let what = match self.request(offset, length) {
                Ok(bytes) => return Ok(bytes),
                Err(Trouble::Final(fault)) => return Err(fault),
                Err(Trouble::Passing(what)) => what,
            };
            if attempt >= self.retries {
                let tries = attempt + 1;
                return Err(ArchiveFault::Server(format!("{what} (tried {tries} times)")));
            }
            self.sleep(wait)?;
            wait = wait.saturating_mul(2);
        }
        unreachable!("the loop ends with the last attempt")
    }

    /// Waits, but not for long once the archive is closed.
    fn sleep(&self, total: Duration) -> Result<(), ArchiveFault> {
        let mut left = total;
        while !left.is_zero() && !self.breaker.is_closed() {
            let nap = left.min(NAP);
            std::thread::sleep(nap);
            left -= nap;
        }
        if self.breaker.is_closed() { Err(ArchiveFault::Closed) } else { Ok(()) }
    }

    fn request(&self, offset: u64, length: usize) -> Result<Bytes, Trouble> {
        let last = offset.saturating_add(length as u64).saturating_sub(1);
        let range = format!("bytes={offset}-{last}");
        let response = self.agent.get(&self.url).header("range", range).call();
        let response = response.map_err(trouble)?;
        let encoding = text(response.headers(), "content-encoding");
        if encoding.as_deref().is_some_and(|encoding| encoding != "identity") {
            return Err(refused("it encodes the archive on its own, which breaks ranges"));
        }
        match response.status().as_u16() {
            206 => self.partial(response, offset, length),
            200 => self.entire(response, offset, length),
            416 => Err(self.beyond(&response, offset)),
            status @ (408 | 429 | 500..) => {
                Err(Trouble::Passing(format!("it answers with status {status}")))
            }
            status => Err(refused(format!("it answers with status {status}"))),
        }
    }

    /// An answer with the bytes asked for.
    fn partial(
        &self,
        response: Response<Body>,
        offset: u64,
        length: usize,
    ) -> Result<Bytes, Trouble> {
        let range = text(response.headers(), "content-range");
        let range = range.as_deref().and_then(content_range);
        let Some(ContentRange { first, last, size }) = range else {
            return Err(refused("it sends a part without saying which"));
        };
        self.compare(Seen { size, version: version(response.headers()) })?;
        let length = length as u64;
        let expected = (last + 1).saturating_sub(first);
        let ends = size.is_none_or(|size| last + 1 == size);
        if first != offset || expected > length || (expected < length && !ends) {
            return Err(refused("it sends another range than asked for"));
        }
        body(response, expected)
    }

    /// An answer with everything, though a range was asked for.
    fn entire(
        &self,
        response: Response<Body>,
        offset: u64,
        length: usize,
    ) -> Result<Bytes, Trouble> {
        let size = response.body().content_length();
        self.compare(Seen { size, version: version(response.headers()) })?;
        let Some(size) = size.filter(|size| *size <= WHOLE_BYTES_MAX) else {
            let size = size.map_or("of unknown size".into(), |size| format!("{size} bytes long"));
            return Err(refused(format!(
                "it ignores range requests, and the archive is {size}; without them at most \
                 {WHOLE_BYTES_MAX} bytes are fetched"
            )));
        };
        let whole = body(response, size)?;
        slice(self.whole.get_or_init(|| whole), offset, length).map_err(Trouble::Final)
    }

    /// An answer that there are no bytes so far out.
    fn beyond(&self, response: &Response<Body>, offset: u64) -> Trouble {
        let range = text(response.headers(), "content-range");
        let size = range.as_deref().and_then(|it| it.strip_prefix("bytes */")?.parse().ok());
        let known = self.seen.lock().is_some();
        let now = Seen { size, version: version(response.headers()) };
        match self.compare(now) {
            Err(changed) if known => changed,
            _ => {
                let what = format!("the server has no bytes from {offset} on");
                Trouble::Final(ArchiveFault::Corrupt(what))
            }
        }
    }

    /// The archive must stay what it was in the first answer, as far as both answers tell.
    fn compare(&self, now: Seen) -> Result<(), Trouble> {
        let mut seen = self.seen.lock();
        let Some(first) = seen.as_ref() else {
            *seen = Some(now);
            return Ok(());
        };
        let changed = |what: String| Err(Trouble::Final(ArchiveFault::Changed(what)));
        match (first.size, now.size, &first.version, &now.version) {
            (Some(then), Some(now), ..) if then != now => {
                changed(format!("the server had {then} bytes of it and now has {now}"))
            }
            (_, _, Some(then), Some(now)) if then != now => {
                changed(format!("the server named its version {then} and now {now}"))
            }
            _ => Ok(()),
        }
    }
}

/// Exactly `expected` bytes of a body.
fn body(response: Response<Body>, expected: u64) -> Result<Bytes, Trouble> {
    let capacity = usize::try_from(expected).map_err(|_| refused("it sends too much"))?;
    let mut bytes = Vec::with_capacity(capacity);
    let mut limited = response.into_body().into_reader().take(expected + 1);
    if let Err(error) = limited.read_to_end(&mut bytes) {
        return Err(Trouble::Passing(format!("it breaks off within an answer: {error}")));
    }
    match bytes.len().cmp(&capacity) {
        std::cmp::Ordering::Equal => Ok(Bytes::from(bytes)),
        std::cmp::Ordering::Less => Err(Trouble::Passing("it breaks off within an answer".into())),
        std::cmp::Ordering::Greater => Err(refused("it sends more than it announced")),
    }
}

fn slice(whole: &Bytes, offset: u64, length: usize) -> Result<Bytes, ArchiveFault> {
    let Some(start) = usize::try_from(offset).ok().filter(|start| *start <= whole.len()) else {
        return Err(ArchiveFault::Corrupt(format!("it has no bytes from {offset} on")));
    };
    Ok(whole.slice(start..start.saturating_add(length).min(whole.len())))
}

/// A failed request may do better next time unless it was never a proper one.
fn trouble(error: Error) -> Trouble {
    match error {
        Error::Io(_)
        | Error::Timeout(_)
        | Error::HostNotFound
        | Error::ConnectionFailed
        | Error::Protocol(_) => Trouble::Passing(error.to_string()),
        _ => refused(error.to_string()),
    }
}

fn text(headers: &HeaderMap, name: &str) -> Option<String> {
    headers.get(name)?.to_str().ok().map(|value| value.trim().to_owned())
}

fn version(headers: &HeaderMap) -> Option<String> {
    text(headers, "etag").or_else(|| text(headers, "last-modified"))
}

/// What a partial answer holds: bytes `first` to `last`, of `size`.
#[derive(PartialEq, Debug)]
struct ContentRange {
    first: u64,
    last: u64,
    size: Option<u64>,
}

/// Reads `bytes first-last/size`, the size being `*` where unknown.
fn content_range(header: &str) -> Option<ContentRange> {
    let (range, size) = header.strip_prefix("bytes ")?.split_once('/')?;
    let (first, last) = range.trim().split_once('-')?;
    let (first, last) = (first.parse().ok()?, last.parse().ok()?);
    let size = if size == "*" { None } else { Some(size.parse().ok()?) };
    let sound = first <= last && last < size.unwrap_or(u64::MAX);
    sound.then_some(ContentRange { first, last, size })
}

/// This machine is reached without a proxy.
fn is_local(url: &str) -> bool {
    let rest = url.split_once("://").map_or(url, |(_, rest)| rest);
    let authority = rest.split(['/', '?', '#']).next().unwrap_or_default();
    let host = authority.rsplit_once('@').map_or(authority, |(_, host)| host);
    let is =
        |name: &str| host == name || host.strip_prefix(name).is_some_and(|r| r.starts_with(':'));
    host.starts_with("127.") || is("localhost") || is("[::1]")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_ranges_are_read_or_refused() {
        let range = |first, last, size| Some(ContentRange { first, last, size });
        assert_eq!(content_range("bytes 0-9/10"), range(0, 9, Some(10)));
        assert_eq!(content_range("bytes 5-5/*"), range(5, 5, None));
        for bad in ["", "bytes */10", "bytes 9-0/10", "bytes 0-10/10", "0-9/10", "bytes 0-x/10"] {
            assert_eq!(content_range(bad), None, "{bad}");
        }
        assert_eq!(content_range("bytes 0-18446744073709551615/*"), None);
    }

    #[test]
    fn only_this_machine_is_local() {
        for url in ["http://127.0.0.1:80/a", "http://localhost", "http://u:p@[::1]:9/x"] {
            assert!(is_local(url), "{url}");
        }
        for url in ["http://localhost.org/", "https://example.org/127.0.0.1"] {
            assert!(!is_local(url), "{url}");
        }
    }
}
