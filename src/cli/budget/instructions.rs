//! Instructions of each frame, counted by valgrind's callgrind in a run of their own.
//!
//! In:    what is flown, how many of its frames.
//! Out:   a count for each of these frames.
//! Keeps: nothing; callgrind's file is thrown away.
//! Not here: which function is a frame ([`COUNTED`] in `flown`), what may be spent (`budget`).
//!
//! The frame's caller does all of it alone, so what is counted is the frame's own instructions and
//! neither those of loaders nor waiting. Two runs of one program agree to a few in a million: only
//! what the system answers differs.

use super::fly::Plan;
use crate::cli::Failure;
use crate::cli::flown::COUNTED;
use indicatif::{ProgressBar, ProgressStyle};
use overfly::replay::budget::Sampled;
use overfly::replay::budget::record::INSTRUCTIONS;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// How often a finished or interrupted run is looked for.
const LOOK_MS: u64 = 50;

/// Counts the first `count` frames of the record, which begins with frame `first`. Nothing where it
/// was stopped.
pub fn count(
    plan: &Plan,
    (first, count): (usize, usize),
    stop: &AtomicBool,
) -> Result<Sampled, Failure> {
    let folder = tempfile::tempdir()?;
    let (out, record) = (folder.path().join("callgrind"), folder.path().join("run.json"));
    let mut command = Command::new("valgrind");
    command.args(["--tool=callgrind", "--combine-dumps=yes", "--collect-atstart=no"]);
    command.arg(format!("--callgrind-out-file={}", out.display()));
    // Callgrind takes one option a pattern.
    command.arg(format!("--toggle-collect=*{COUNTED}*"));
    command.arg(format!("--dump-after=*flown*{COUNTED}*"));
    command.arg(std::env::current_exe()?).args(["budget", &plan.flight]);
    command.args(["--counters-only", "--errors", "0", "--runs", "1", "--workers", "0"]);
    command.args(["--frames", &format!("{first}..{}", first + count)]);
    let [width, height] = plan.manner.size_px;
    command.args(["--size", &format!("{width}x{height}")]);
    command.args(["--loader-delay-ms", &plan.loader_delay_ms.to_string()]);
    if let Some(scene) = &plan.scene_given {
        command.args(["--scene", scene]);
    }
    command.arg("--record").arg(&record);
    let said = fs::File::create(folder.path().join("said"))?;
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(said);
    let mut child = command.spawn().map_err(|error| {
        format!("--instructions: cannot run valgrind: {error}; on Debian, apt install valgrind")
    })?;
    if !waited(&mut child, count, stop)? {
        return Ok(Sampled::default());
    }
    let status = child.wait()?;
    if !status.success() {
        let said = fs::read_to_string(folder.path().join("said"))?;
        let why = said.lines().rfind(|line| !line.starts_with("==")).unwrap_or_default();
        return Err(
            format!("--instructions: the run under valgrind ended with {status}: {why}").into()
        );
    }
    let counted = counted(&out, count)?;
    let frames = (0..counted.len()).map(u32::try_from).collect::<Result<_, _>>()?;
    Ok(Sampled { frames, columns: BTreeMap::from([(INSTRUCTIONS.to_owned(), counted)]) })
}

/// Waits for the end; false where it was stopped.
fn waited(child: &mut Child, count: usize, stop: &AtomicBool) -> Result<bool, Failure> {
    let style = ProgressStyle::with_template("{spinner} {elapsed} counting instructions, {msg}")?;
    let bar = ProgressBar::new_spinner().with_style(style);
    bar.set_message(format!("{count} frames under valgrind"));
    while child.try_wait()?.is_none() {
        if stop.load(Ordering::Relaxed) {
            // It may have ended by the same Ctrl-C.
            let _ = child.kill();
            child.wait()?;
            return Ok(false);
        }
        bar.tick();
        std::thread::sleep(Duration::from_millis(LOOK_MS));
    }
    bar.finish_and_clear();
    Ok(!stop.load(Ordering::Relaxed))
}

/// The last `count` totals of callgrind's file that counted anything: those before are of frames in
/// which the terrain came up.
fn counted(file: &Path, count: usize) -> Result<Vec<f64>, Failure> {
    let text = fs::read_to_string(file)
        .map_err(|error| format!("--instructions: callgrind wrote no counts: {error}"))?;
    let totals = text.lines().filter_map(|line| line.strip_prefix("totals: "));
    let totals: Vec<f64> = totals.map(str::parse).collect::<Result<_, _>>()?;
    let all: Vec<f64> = totals.into_iter().filter(|&total| total > 0.0).collect();
    let found = all.len();
    if found < count {
        return Err(format!(
            "--instructions: callgrind counted {found} frames of {count}: does the program have its \
             symbols?"
        )
        .into());
    }
    Ok(all[found - count..].to_vec())
}
