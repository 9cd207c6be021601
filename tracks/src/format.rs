//! Which format a file is in, by what it holds.
//!
//! In:    a text, the file's name.
//! Out:   a [`Format`].
//! Keeps: nothing.
//! Not here: archives and encodings (`unpack`), reading the formats (`formats`).

/// How much of a file is looked at to know its format, in bytes and lines.
const LOOKED_AT: usize = 64 << 10;
const LINES: usize = 200;

/// Formats of recorded flights.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Format {
    /// Gliders' flight recorders, by the FAI.
    Igc,
    /// GPS exchange format.
    Gpx,
    /// Google Earth: `gx:Track`, or placemarks with times.
    Kml,
    /// X-Plane's flight data recorder, versions 1 to 4.
    Fdr,
    /// Tacview.
    Acmi,
    /// GPS receivers' sentences.
    Nmea,
    /// FlightGear's generic protocol with its usual titles.
    FlightGear,
    /// ADS-B as a table: traffic library, OpenSky.
    AdsbCsv,
    /// ADS-B as JSON: records, OpenSky tracks and states, readsb traces and snapshots.
    AdsbJson,
    /// ADS-B as lines `MSG,3,…` of BaseStation, which dump1090 and others write on port 30003.
    BaseStation,
    /// overfly's own table, or one whose titles name units.
    Csv,
    /// A table that a column map describes.
    MappedCsv,
}

impl Format {
    /// All of them.
    pub const ALL: [Self; 12] = [
        Self::Igc,
        Self::Gpx,
        Self::Kml,
        Self::Fdr,
        Self::Acmi,
        Self::Nmea,
        Self::FlightGear,
        Self::AdsbCsv,
        Self::AdsbJson,
        Self::BaseStation,
        Self::Csv,
        Self::MappedCsv,
    ];

    /// As messages call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Igc => "IGC",
            Self::Gpx => "GPX",
            Self::Kml => "KML",
            Self::Fdr => "X-Plane FDR",
            Self::Acmi => "Tacview ACMI",
            Self::Nmea => "NMEA",
            Self::FlightGear => "FlightGear CSV",
            Self::AdsbCsv => "ADS-B CSV",
            Self::AdsbJson => "ADS-B JSON",
            Self::BaseStation => "BaseStation (SBS-1)",
            Self::Csv => "CSV",
            Self::MappedCsv => "CSV with a column map",
        }
    }

    /// The format of a text; tables are all [`Format::Csv`] here. `None` where it is in none.
    pub(crate) fn of(text: &str, file: &str) -> Option<Self> {
        let mut end = text.len().min(LOOKED_AT);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        let head = text[..end].trim_start();
        let file = file.to_ascii_lowercase();
        if head.starts_with('<') {
            let has = |tag: &str| head.contains(tag);
            return match (has("<kml") || has("<Placemark"), has("<gpx")) {
                (true, _) => Some(Self::Kml),
                (_, true) => Some(Self::Gpx),
                _ if file.ends_with(".kml") => Some(Self::Kml),
                _ if file.ends_with(".gpx") => Some(Self::Gpx),
                _ => None,
            };
        }
        // Terminals write times in brackets before a receiver's sentences.
        let is_log = head.starts_with('[') && head.lines().next().is_some_and(is_sentence);
        if head.starts_with(['{', '[']) && !is_log {
            return Some(Self::AdsbJson);
        }
        if head.starts_with("FileType=text/acmi") {
            return Some(Self::Acmi);
        }
        Self::of_lines(head, &file)
    }

    fn of_lines(head: &str, file: &str) -> Option<Self> {
        let lines =
            || head.split(['\n', '\r']).map(str::trim).filter(|l| !l.is_empty()).take(LINES);
        let mut first_two = lines();
        let (first, second) = (first_two.next()?, first_two.next().unwrap_or(""));
        if matches!(first, "A" | "I") && second.starts_with(['1', '2', '3', '4']) {
            return Some(Self::Fdr);
        }
        if lines().any(is_b_record) || file.ends_with(".igc") {
            return Some(Self::Igc);
        }
        if lines().any(is_sentence) || file.ends_with(".nmea") {
            return Some(Self::Nmea);
        }
        if lines().any(|line| line.starts_with("MSG,")) {
            return Some(Self::BaseStation);
        }
        match file {
            _ if file.ends_with(".acmi") => Some(Self::Acmi),
            _ if file.ends_with(".fdr") => Some(Self::Fdr),
            _ if first.contains([',', ';', '\t']) => Some(Self::Csv),
            _ => None,
        }
    }
}

fn is_b_record(line: &str) -> bool {
    let bytes = line.as_bytes();
    let figures = |from: usize, to: usize| bytes[from..to].iter().all(u8::is_ascii_digit);
    bytes.len() >= 35 && bytes[0] == b'B' && figures(1, 14) && matches!(bytes[14], b'N' | b'S')
}

fn is_sentence(line: &str) -> bool {
    let Some((_, sentence)) = line.split_once('$') else { return false };
    let kind = sentence.as_bytes();
    kind.len() > 6 && kind[..5].iter().all(u8::is_ascii_uppercase) && kind[5] == b','
}
