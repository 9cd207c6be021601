//! Archives on a server that answers, fails, stalls, lies or is gone.
//!
//! In:    a server on this machine.
//! Out:   tiles, or an error within the time-outs; a server that failed is left alone.
//! Keeps: nothing.
//! Not here: TLS, which is the client crate's.

use crate::server::{Server, Stall};
use crate::written::{archive, archive_of, facts, keys, payload};
use overfly_archive::{Archive, ArchiveError, ArchiveFault, Location, OpenOptions};
use overfly_core::datasource::PageKey;
use pmtiles::{Compression, TileType};
use std::time::Duration;

fn patient() -> OpenOptions {
    OpenOptions {
        connect_timeout: Duration::from_secs(2),
        read_timeout: Duration::from_secs(2),
        retries: 2,
        backoff: Duration::from_millis(5),
        failures_max: 1,
        cool_down: Duration::from_secs(3600),
        reader: None,
    }
}

fn open(server: &Server, options: &OpenOptions) -> Result<Archive, ArchiveError> {
    Archive::open(&Location::parse(&server.url()), options)
}

fn small() -> Vec<u8> {
    archive(2, Compression::Gzip, Compression::Zstd)
}

fn root() -> PageKey {
    PageKey::root(0)
}

#[test]
fn tiles_come_through_range_requests() {
    let server = Server::new(archive(6, Compression::Gzip, Compression::Zstd));
    let archive = open(&server, &patient()).unwrap();
    assert_eq!(archive.facts(), &facts(6));
    let opening = server.requests();
    assert!(opening <= 2, "header and metadata, in {opening} requests");
    let some: Vec<PageKey> = keys(6).into_iter().step_by(601).collect();
    for &key in &some {
        assert_eq!(archive.tile(key).unwrap(), Some(payload(key)), "{key:?}");
    }
    let requests = server.requests() - opening;
    let directories = 6;
    assert!(requests as usize <= some.len() + directories, "{requests} requests");
}

#[test]
fn the_first_failures_are_tried_again() {
    for status in [500, 503, 429] {
        let server = Server::new(small());
        server.change(|it| (it.failing, it.status) = (2, status));
        let archive = open(&server, &patient()).unwrap();
        server.change(|it| it.failing = 2);
        assert_eq!(archive.tile(root()).unwrap(), Some(payload(root())));
        assert_eq!(archive.health().failures, 0);
    }
}

#[test]
fn a_status_that_will_not_change_is_not_tried_again() {
    let server = Server::new(small());
    server.change(|it| (it.failing, it.status) = (100, 404));
    let error = open(&server, &patient()).unwrap_err();
    assert!(matches!(error.fault, ArchiveFault::Server(_)));
    assert!(error.to_string().contains("404") && error.to_string().contains(&server.url()));
    assert_eq!(server.requests(), 1);
}

#[test]
fn a_dead_server_is_left_alone_after_the_first_exhausted_retries() {
    let server = Server::new(small());
    let archive = open(&server, &patient()).unwrap();
    drop(server);
    let error = archive.tile(root()).unwrap_err();
    assert!(error.to_string().contains("tried 3 times"), "{error}");
    assert!(archive.health().resting);
    for _ in 0..1000 {
        let error = archive.tile(PageKey::root(1)).unwrap_err();
        assert!(matches!(error.fault, ArchiveFault::Resting(_)), "{error}");
    }
    let health = archive.health();
    assert_eq!((health.failures, health.refused), (1, 1000));
    assert!(health.last_error.unwrap().contains("server fails"));
}

#[test]
fn a_server_that_comes_back_is_asked_again_after_its_rest() {
    let server = Server::new(small());
    let options = OpenOptions { retries: 0, cool_down: Duration::from_millis(50), ..patient() };
    let archive = open(&server, &options).unwrap();
    server.change(|it| it.failing = 1);
    assert!(archive.tile(root()).is_err());
    std::thread::sleep(Duration::from_millis(60));
    assert_eq!(archive.tile(root()).unwrap(), Some(payload(root())));
    let health = archive.health();
    assert_eq!((health.failures, health.resting), (1, false));
}

#[test]
fn so_many_failures_in_a_row_as_allowed_do_not_end_the_asking() {
    let server = Server::new(small());
    let options = OpenOptions { retries: 0, failures_max: 3, ..patient() };
    let archive = open(&server, &options).unwrap();
    server.change(|it| it.failing = 2);
    assert!(archive.tile(root()).is_err() && archive.tile(root()).is_err());
    assert_eq!(archive.tile(root()).unwrap(), Some(payload(root())));
    server.change(|it| it.failing = 100);
    (0..4).for_each(|_| assert!(archive.tile(root()).is_err()));
    let health = archive.health();
    assert_eq!((health.failures, health.refused, health.resting), (5, 1, true));
}

#[test]
fn stalls_end_with_the_time_out() {
    for stall in [Stall::Header, Stall::Body] {
        let server = Server::new(small());
        let read_timeout = Duration::from_millis(200);
        let options = OpenOptions { read_timeout, retries: 1, ..patient() };
        let archive = open(&server, &options).unwrap();
        let before = server.requests();
        server.change(|it| it.stall = Some(stall));
        let error = archive.tile(root()).unwrap_err();
        assert!(matches!(error.fault, ArchiveFault::Server(_)), "{error}");
        assert_eq!(server.requests() - before, 2);
    }
}

#[test]
fn bodies_that_end_early_are_asked_for_again_and_never_taken() {
    let server = Server::new(small());
    let archive = open(&server, &patient()).unwrap();
    let before = server.requests();
    server.change(|it| it.cut = true);
    let error = archive.tile(root()).unwrap_err();
    assert!(error.to_string().contains("breaks off"), "{error}");
    assert_eq!(server.requests() - before, 3);
}

#[test]
fn another_range_than_asked_for_is_refused() {
    let server = Server::new(small());
    server.change(|it| it.shift = 1);
    let error = open(&server, &patient()).unwrap_err();
    assert!(error.to_string().contains("another range"), "{error}");
}

#[test]
fn a_server_without_ranges_gives_small_archives_once_and_as_a_whole() {
    let server = Server::new(small());
    server.change(|it| it.ranges = false);
    let archive = open(&server, &patient()).unwrap();
    for key in keys(2) {
        assert_eq!(archive.tile(key).unwrap(), Some(payload(key)), "{key:?}");
    }
    assert_eq!(server.requests(), 1);
}

#[test]
fn a_server_without_ranges_is_refused_where_the_archive_is_large() {
    let server = Server::new(small());
    server.change(|it| (it.ranges, it.claimed_length) = (false, Some(100 << 30)));
    let error = open(&server, &patient()).unwrap_err();
    assert!(error.to_string().contains("ignores range requests"), "{error}");
    assert!(error.to_string().contains("107374182400"), "{error}");
}

#[test]
fn an_archive_that_changes_on_the_server_is_noticed() {
    let change = |change: fn(&mut crate::server::Behaviour)| {
        let server = Server::new(small());
        let archive = open(&server, &patient()).unwrap();
        server.change(change);
        let before = server.requests();
        let error = archive.tile(root()).unwrap_err();
        assert!(matches!(error.fault, ArchiveFault::Changed(_)), "{error}");
        assert_eq!(server.requests() - before, 1);
        assert!(archive.health().resting);
    };
    change(|it| it.etag = Some("\"two\""));
    change(|it| {
        it.etag = None;
        it.bytes = archive(3, Compression::Gzip, Compression::None).into();
    });
    change(|it| {
        it.ranges = false;
        it.bytes = b"<html>a portal</html>".to_vec().into();
    });
    change(|it| it.bytes = b"short".to_vec().into());
}

#[test]
fn what_is_no_archive_or_too_short_is_named() {
    let case = |bytes: Vec<u8>, expected: &str| {
        let error = open(&Server::new(bytes), &patient()).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    };
    case(b"<html>no</html>".to_vec(), "not a PMTiles archive");
    case(Vec::new(), "no bytes from 0");
    let whole = small();
    case(whole[..whole.len() - 1].to_vec(), "but its tiles end at byte");
    let none = (Compression::Gzip, Compression::None);
    case(archive_of(&keys(1), "{}", TileType::Png, none), "tiles are PNG pictures");
}

#[test]
fn a_closed_archive_asks_nobody_and_wakes_who_waits() {
    let server = Server::new(small());
    let options = OpenOptions { retries: 1, backoff: Duration::from_secs(3600), ..patient() };
    let archive = open(&server, &options).unwrap();
    server.change(|it| it.failing = 100);
    std::thread::scope(|scope| {
        let waits = scope.spawn(|| archive.tile(root()).unwrap_err());
        std::thread::sleep(Duration::from_millis(50));
        archive.close();
        assert!(matches!(waits.join().unwrap().fault, ArchiveFault::Closed));
    });
    let requests = server.requests();
    assert!(matches!(archive.tile(root()).unwrap_err().fault, ArchiveFault::Closed));
    assert_eq!(server.requests(), requests);
}

#[test]
fn addresses_that_cannot_be_are_refused_at_once() {
    for url in ["http://", "http://a b/", "https://[::"] {
        let error = Archive::open(&Location::parse(url), &patient()).unwrap_err();
        assert!(matches!(error.fault, ArchiveFault::Server(_)), "{error}");
    }
}
