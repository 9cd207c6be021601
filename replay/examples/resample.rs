//! Makes a bundled flight from a flight simulator's CSV file.
//!
//! In:    `resample CSV OUT.ovf`.
//! Out:   the flight at 60 Hz; its name is that of the output file.
//! Keeps: nothing.
//! Not here: the resampling itself (`overfly_replay::resample`).

use overfly_replay::resample::flight_from_csv;
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [csv, out] = arguments.as_slice() else {
        return Err("usage: resample CSV OUT.ovf".into());
    };
    let out = Path::new(out);
    let name = out.file_stem().and_then(|stem| stem.to_str()).ok_or("the output has no name")?;
    let flight = flight_from_csv(&std::fs::read(csv)?, name, 60.0)?;
    flight.write(out)?;
    println!("{}: {} frames", out.display(), flight.poses.len());
    Ok(())
}
