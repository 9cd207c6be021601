//! What is finished is kept at once, so that a trade that was stopped goes on where it was.
//!
//! In:    keys, what was flown.
//! Out:   the same again, by key.
//! Keeps: small files, each written beside its place and renamed there.
//! Not here: what a key is made of (`plan`).

use super::fly::{Pass, Shot, measure_clip, time_clips};
use super::plan::Plan;
use crate::cli::{Failure, write_whole};
use overfly::replay::measure::Measure;
use overfly::replay::trade::{Clip, Point};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

/// A folder of finished clips and passes.
pub struct Kept {
    /// Where they lie.
    pub folder: PathBuf,
    /// How many were there already.
    pub found: usize,
    /// How many were flown.
    pub flown: usize,
}

impl Kept {
    /// Opens a folder, which need not be there yet.
    pub fn new(folder: PathBuf) -> Self {
        Self { folder, found: 0, flown: 0 }
    }

    /// A clip of a point, flown unless it is there; `None` when stopped.
    pub fn clip(
        &mut self,
        plan: &Plan,
        (point, clip): (&Point, &Clip),
        measure: &mut Option<Measure>,
        stop: &AtomicBool,
    ) -> Result<Option<Shot>, Failure> {
        let key = plan.clip_key(point, clip)?;
        self.get_or(key, || measure_clip(plan, (point, clip), measure, stop))
    }

    /// A timing pass of a point, flown unless it is there; `None` when stopped.
    pub fn pass(
        &mut self,
        plan: &Plan,
        (point, round): (&Point, u32),
        stop: &AtomicBool,
    ) -> Result<Option<Pass>, Failure> {
        let key = plan.pass_key(point, round)?;
        self.get_or(key, || time_clips(plan, point, stop))
    }

    /// A file that cannot be read, or not whole, is as good as none: it is flown again.
    fn get_or<T: Serialize + DeserializeOwned>(
        &mut self,
        key: u64,
        fly: impl FnOnce() -> Result<Option<T>, Failure>,
    ) -> Result<Option<T>, Failure> {
        let path = self.folder.join(format!("{key:016x}.json"));
        let text = std::fs::read_to_string(&path);
        if let Some(kept) = text.ok().and_then(|text| serde_json::from_str(&text).ok()) {
            self.found += 1;
            return Ok(Some(kept));
        }
        let Some(fresh) = fly()? else { return Ok(None) };
        let text = serde_json::to_string(&fresh)?;
        write_whole(&path, text.as_bytes())?;
        self.flown += 1;
        // Reading JSON rounds: what is used is what a later run will read.
        Ok(Some(serde_json::from_str(&text)?))
    }
}
