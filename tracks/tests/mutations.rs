//! Ten thousand truncated and mutated files of each format: an error with its place, or a track.
//!
//! In:    a small file of each format, written here; numbers that are the same in every run.
//! Out:   passes or fails; how many imported, printed.
//! Keeps: nothing.
//! Not here: sound files (`recordings`, `rainier`).

mod samples;

use core::f64::consts::FRAC_PI_2;
use overfly_tracks::{Options, TrackError, import};

const ROUNDS: u64 = 10_000;

/// A small generator of equal numbers in every run (xorshift64*).
struct Dice(u64);

impl Dice {
    fn roll(&mut self, sides: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let high = self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33;
        usize::try_from(high).unwrap() % sides.max(1)
    }
}

/// Pieces that parsers stumble over.
const PIECES: [&[u8]; 20] = [
    b"",
    b"-",
    b"9999999999999999999999",
    b"NaN",
    b"1e308",
    b"-1e-308",
    b"\xFF\xFE",
    b"\0",
    b"\r",
    b"\n\n",
    b",,,,",
    b"|",
    b"\"",
    b"<",
    b"</trk>",
    b"[[[[",
    b"{",
    b"\xC3\xA9",
    b"\\",
    b"235960",
];

fn mutated(sample: &[u8], dice: &mut Dice) -> Vec<u8> {
    let mut bytes = sample.to_vec();
    for _ in 0..=dice.roll(4) {
        let at = dice.roll(bytes.len());
        match dice.roll(7) {
            0 => bytes.truncate(at),
            1 if at < bytes.len() => bytes[at] ^= 1 << dice.roll(8),
            2 if at < bytes.len() => bytes[at] = b"0123456789.-:,NSEWAV"[dice.roll(20)],
            3 => {
                let end = (at + dice.roll(40)).min(bytes.len());
                bytes.drain(at..end);
            }
            4 => {
                let end = (at + dice.roll(80)).min(bytes.len());
                let copy = bytes[at..end].to_vec();
                let to = dice.roll(bytes.len());
                bytes.splice(to..to, copy);
            }
            _ => {
                let piece = PIECES[dice.roll(PIECES.len())];
                bytes.splice(at..at, piece.iter().copied());
            }
        }
    }
    bytes
}

/// An import of `bytes` ends in sound poses, or in an error that says where.
fn check(bytes: &[u8], file: &str, options: &Options) -> bool {
    match import(bytes, file, options, &|_, _| 30.0) {
        Ok(found) => {
            for flight in &found.flights {
                let end_s = flight.duration_s();
                for time_s in [0.0, end_s / 3.0, end_s] {
                    let pose = flight.pose(time_s);
                    let numbers = [
                        pose.at.lat_rad,
                        pose.at.lon_rad,
                        pose.at.height_m,
                        pose.heading.0,
                        pose.pitch.0,
                        pose.roll.0,
                    ];
                    assert!(numbers.iter().all(|n| n.is_finite()), "{file}: {pose:?}");
                    let lat_rad = pose.at.lat_rad.abs();
                    assert!(lat_rad <= FRAC_PI_2 && pose.at.height_m > -13_000.0);
                }
            }
            true
        }
        Err(error) => {
            if let TrackError::Fault(fault) | TrackError::TooManyFaults { first: fault, .. } =
                &error
            {
                assert!(fault.line >= 1 && fault.column >= 1, "{file}: {error}");
            }
            assert!(!error.to_string().is_empty());
            false
        }
    }
}

fn survive(file: &str, sample: &[u8], options: &Options) {
    assert!(check(sample, file, options), "the sample of {file} itself imports");
    let mut dice = Dice(0x9E37_79B9_7F4A_7C15 ^ sample.len() as u64);
    let mut imported = 0;
    for round in 0..ROUNDS {
        let bytes = match usize::try_from(round).unwrap() {
            // First every length there is.
            cut if cut < sample.len() => sample[..cut].to_vec(),
            _ => mutated(sample, &mut dice),
        };
        imported += u32::from(check(&bytes, file, options));
    }
    println!("{file}: {imported} of {ROUNDS} imported, the others say why not");
    assert!(imported > 100, "{file}: hardly any mutation imports");
}

/// One test a format, so that they run side by side.
macro_rules! survives {
    ($($name:ident: $file:expr, $sample:expr;)*) => {$(
        #[test]
        fn $name() {
            survive($file, &$sample, &Options::default());
        }
    )*};
}

survives! {
    igc_survives_mutations: "a.igc", samples::igc().into_bytes();
    gpx_survives_mutations: "a.gpx", samples::gpx().into_bytes();
    kml_survives_mutations: "a.kml", samples::kml().into_bytes();
    placemarks_survive_mutations: "b.kml", samples::placemarks().into_bytes();
    fdr_4_survives_mutations: "a.fdr", samples::fdr_4().into_bytes();
    fdr_1_survives_mutations: "c.fdr", samples::fdr_1().into_bytes();
    fdr_3_survives_mutations: "b.fdr", samples::fdr_3().into_bytes();
    acmi_survives_mutations: "a.acmi", samples::acmi().into_bytes();
    zipped_acmi_survives_mutations: "a.zip.acmi", samples::zipped("a.txt.acmi", &samples::acmi());
    nmea_survives_mutations: "a.nmea", samples::nmea().into_bytes();
    flightgear_survives_mutations: "a.csv", samples::flightgear().into_bytes();
    adsb_csv_survives_mutations: "b.csv", samples::adsb_csv().into_bytes();
    adsb_records_survive_mutations: "a.json", samples::adsb_json().into_bytes();
    adsb_traces_survive_mutations: "b.json", samples::trace_json().into_bytes();
    adsb_snapshots_survive_mutations: "c.json", samples::snapshots().into_bytes();
    adsb_columns_survive_mutations: "d.json", samples::columns_json().into_bytes();
    base_station_survives_mutations: "a.txt", samples::base_station().into_bytes();
    wide_csv_survives_mutations: "e.csv", samples::utf_16(&samples::own_csv(), "\u{FEFF}");
    gps_dump_survives_mutations: "c.kml", samples::gps_dump().into_bytes();
    arrays_survive_mutations: "d.kml", samples::arrays_kml().into_bytes();
    terminals_survive_mutations: "a.log", samples::terminal().into_bytes();
    g1000_survives_mutations: "f.csv", samples::g1000().into_bytes();
    own_csv_survives_mutations: "c.csv", samples::own_csv().into_bytes();
}

/// Check sums find nearly all that is done to a packed file: half of the rounds damage what is in it.
#[test]
fn gzip_survives_mutations_inside_and_out() {
    let (igc, mut dice) = (samples::igc().into_bytes(), Dice(11));
    let packed = samples::gzipped(&igc);
    let options = Options::default();
    assert!(check(&packed, "a.igc.gz", &options));
    let mut imported = 0;
    for round in 0..ROUNDS {
        let bytes = match round % 2 {
            0 => mutated(&packed, &mut dice),
            _ => samples::gzipped(&mutated(&igc, &mut dice)),
        };
        imported += u32::from(check(&bytes, "a.igc.gz", &options));
    }
    assert!(imported > 100, "hardly any mutation imports");
}

#[test]
fn mapped_csv_survives_mutations() {
    let columns = overfly_tracks::ColumnMap::from_ron(samples::MAP).unwrap();
    let options = Options { columns: Some(columns), ..Options::default() };
    survive("d.txt", samples::untitled().as_bytes(), &options);
}

#[test]
fn column_maps_survive_mutations() {
    let mut dice = Dice(7);
    for _ in 0..ROUNDS {
        let bytes = mutated(samples::MAP.as_bytes(), &mut dice);
        if let Err(error) = overfly_tracks::ColumnMap::from_ron(&String::from_utf8_lossy(&bytes)) {
            assert!(error.to_string().contains("column"), "{error}");
        }
    }
}

#[test]
fn archives_that_unpack_to_too_much_are_refused() {
    let options = Options { bytes_max: 1 << 20, ..Options::default() };
    let bomb = samples::zipped("a.txt.acmi", &"0".repeat(5 << 20));
    assert!(bomb.len() < 100_000);
    let error = import(&bomb, "a.zip.acmi", &options, &|_, _| 0.0).unwrap_err();
    assert!(error.to_string().contains("larger than 1048576 bytes"), "{error}");
    let bomb = samples::gzipped("0".repeat(5 << 20).as_bytes());
    assert!(bomb.len() < 100_000);
    let error = import(&bomb, "a.json", &options, &|_, _| 0.0).unwrap_err();
    assert!(error.to_string().contains("larger than 1048576 bytes"), "{error}");
    let error = import(&vec![b' '; 2 << 20], "a.csv", &options, &|_, _| 0.0).unwrap_err();
    assert!(matches!(error, TrackError::TooLarge { .. }), "{error}");
}
