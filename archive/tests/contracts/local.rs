//! Archives on disk.
//!
//! In:    archives of the crate's writer, in files.
//! Out:   every tile as it was written, none where there was none, from any thread.
//! Keeps: nothing.
//! Not here: damaged ones (`hostile`), served ones (`remote`).

use crate::written::{archive, archive_of, facts, file, keys, open, payload};
use overfly_archive::{Archive, ArchiveFault, Health, Location, OpenOptions};
use overfly_core::datasource::PageKey;
use pmtiles::{Compression, TileType};
use std::path::PathBuf;

#[test]
fn every_tile_comes_back_as_it_was_written() {
    let none = Compression::None;
    for tiles in [none, Compression::Gzip, Compression::Zstd] {
        for internal in [none, Compression::Gzip, Compression::Zstd] {
            let archive = open(&archive(3, internal, tiles)).unwrap();
            assert_eq!(archive.facts(), &facts(3));
            for key in keys(3) {
                assert_eq!(archive.tile(key).unwrap(), Some(payload(key)), "{key:?}");
            }
            assert_eq!(archive.tile(PageKey::new(2, 4, 3, 1)).unwrap(), None);
            assert_eq!(archive.health(), Health::default());
        }
    }
}

#[test]
fn leaf_directories_are_followed_and_kept() {
    // More tiles than a root directory has room for.
    let archive = open(&archive(6, Compression::Gzip, Compression::None)).unwrap();
    for _ in 0..2 {
        for key in keys(6).into_iter().step_by(7) {
            assert_eq!(archive.tile(key).unwrap(), Some(payload(key)), "{key:?}");
        }
        assert_eq!(archive.tile(PageKey::new(1, 23, 77, 1)).unwrap(), None);
    }
}

#[test]
fn an_archive_with_holes_has_no_tiles_there() {
    let metadata = overfly_archive::metadata::to_json(&facts(9), serde_json::Value::Null);
    let some: Vec<PageKey> = keys(5).into_iter().step_by(3).collect();
    let how = (Compression::Gzip, Compression::Zstd);
    let archive = open(&archive_of(&some, &metadata, TileType::Unknown, how)).unwrap();
    for (i, key) in keys(5).into_iter().enumerate() {
        let expected = (i % 3 == 0).then(|| payload(key));
        assert_eq!(archive.tile(key).unwrap(), expected, "{key:?}");
    }
}

#[test]
fn loader_threads_share_an_archive() {
    let archive = open(&archive(6, Compression::Gzip, Compression::Zstd)).unwrap();
    let read = |start: usize| {
        for key in keys(6).into_iter().skip(start).step_by(23) {
            assert_eq!(archive.tile(key).unwrap(), Some(payload(key)), "{key:?}");
        }
    };
    std::thread::scope(|scope| (0..4).for_each(|start| drop(scope.spawn(move || read(start)))));
}

#[test]
fn a_host_with_a_tokio_runtime_can_open_files() {
    let (_folder, path) = file(&archive(1, Compression::Gzip, Compression::None));
    let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
    runtime.block_on(async {
        let archive = Archive::open(&Location::File(path), &OpenOptions::default()).unwrap();
        assert_eq!(archive.tile(PageKey::root(1)).unwrap(), Some(payload(PageKey::root(1))));
    });
}

#[test]
fn what_is_no_regular_file_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    for path in [folder.path().join("absent.pmtiles"), folder.path().to_owned()] {
        let error = Archive::open(&Location::File(path.clone()), &OpenOptions::default());
        let error = error.unwrap_err();
        assert!(matches!(error.fault, ArchiveFault::Open(_)));
        assert!(error.to_string().contains(path.to_str().unwrap()), "{error}");
    }
}

#[test]
fn a_file_that_is_written_to_is_noticed() {
    let bytes = archive(2, Compression::Gzip, Compression::None);
    let (_folder, path) = file(&bytes);
    let archive = Archive::open(&Location::File(path.clone()), &OpenOptions::default()).unwrap();
    std::fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(200).unwrap();
    let error = archive.tile(PageKey::root(0)).unwrap_err();
    assert!(matches!(error.fault, ArchiveFault::Changed(_)), "{error}");
    let health = archive.health();
    assert_eq!((health.failures, health.refused), (1, 0));
    assert!(health.last_error.unwrap().contains("changed"));
}

#[test]
fn a_file_that_is_replaced_by_renaming_is_read_on() {
    let (folder, path) = file(&archive(2, Compression::Gzip, Compression::None));
    let archive = Archive::open(&Location::File(path.clone()), &OpenOptions::default()).unwrap();
    let newer = folder.path().join("newer");
    std::fs::write(&newer, "something else").unwrap();
    std::fs::rename(&newer, &path).unwrap();
    let key = PageKey::root(3);
    assert_eq!(archive.tile(key).unwrap(), Some(payload(key)));
}

#[test]
fn addresses_are_told_from_paths() {
    for url in ["http://host/a.pmtiles", "HTTPS://host:8080/a"] {
        assert_eq!(Location::parse(url), Location::Http(url.into()));
    }
    for path in ["alps.pmtiles", "http/alps.pmtiles", "/a/http://b", "é", ""] {
        assert_eq!(Location::parse(path), Location::File(PathBuf::from(path)));
        assert_eq!(Location::parse(path).to_string(), path);
    }
}
