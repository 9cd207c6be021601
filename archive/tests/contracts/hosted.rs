//! Archives that a host reads itself.
//!
//! In:    functions of a host that read, fail and lie.
//! Out:   tiles, or an error in the host's words.
//! Keeps: nothing.
//! Not here: files and servers (`local`, `remote`).

use crate::written::{archive, facts, keys, payload};
use overfly_archive::{Archive, ArchiveError, ArchiveFault, Location, OpenOptions, Reader};
use overfly_core::datasource::PageKey;
use pmtiles::Compression;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

fn open(reader: Reader) -> Result<Archive, ArchiveError> {
    let options = OpenOptions { reader: Some(reader), ..OpenOptions::default() };
    Archive::open(&Location::parse("pack:/hills"), &options)
}

#[test]
fn tiles_come_through_the_hosts_own_reads_until_it_fails() {
    let bytes = archive(4, Compression::Gzip, Compression::Zstd);
    let fails = Arc::new(AtomicBool::new(false));
    let told = fails.clone();
    let reader = Reader::new(move |name, offset, buffer| {
        assert_eq!(name, "pack:/hills");
        if told.load(Ordering::Relaxed) {
            return Err("the disc was taken out".into());
        }
        let from = usize::try_from(offset).unwrap().min(bytes.len());
        let count = buffer.len().min(bytes.len() - from);
        buffer[..count].copy_from_slice(&bytes[from..from + count]);
        Ok(count)
    });
    let archive = open(reader).unwrap();
    assert_eq!(archive.facts(), &facts(4));
    for key in keys(4).into_iter().step_by(13) {
        assert_eq!(archive.tile(key).unwrap(), Some(payload(key)), "{key:?}");
    }
    fails.store(true, Ordering::Relaxed);
    let error = archive.tile(PageKey::root(0)).unwrap_err().to_string();
    assert_eq!(error, "archive pack:/hills: the host cannot read it: the disc was taken out");
    assert_eq!(archive.health().failures, 1);
    archive.close();
    let closed = archive.tile(PageKey::root(0)).unwrap_err();
    assert!(matches!(closed.fault, ArchiveFault::Closed), "{closed}");
}

#[test]
fn a_host_that_reads_nothing_or_claims_too_much_is_refused() {
    let nothing = open(Reader::new(|_, _, _| Ok(0))).unwrap_err().to_string();
    assert!(nothing.starts_with("archive pack:/hills: it is "), "{nothing}");
    let liar = open(Reader::new(|_, _, buffer| Ok(buffer.len() + 1))).unwrap_err().to_string();
    assert!(liar.contains("were asked for"), "{liar}");
}
