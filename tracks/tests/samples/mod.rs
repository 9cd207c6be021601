//! Small files of every format, as tests need them.
//!
//! In:    nothing.
//! Out:   texts: twelve seconds of a slow climb over the Alps, each in a format's own ways.
//! Keeps: nothing.
//! Not here: real recordings.
#![allow(dead_code, reason = "each test needs some of the samples")]

use std::fmt::Write;
use std::io::Cursor;

/// Seconds of each sample.
pub const SECONDS: u32 = 12;

/// Latitude and longitude in degrees, metres above sea level, of each second.
pub fn place(second: u32) -> (f64, f64, f64) {
    let t = f64::from(second);
    (46.5 + 2e-4 * t, 11.25 - 1e-4 * t, 2000.0 + 3.0 * t)
}

fn text(head: &str, row: impl Fn(u32) -> String, tail: &str) -> String {
    let mut text = head.to_owned();
    (0..SECONDS).for_each(|second| text.push_str(&row(second)));
    text + tail
}

/// Degrees as `DDMM.mmm…` with so many figures of degrees, and decimals.
fn minutes(degrees: f64, figures: usize, decimals: usize) -> String {
    let whole = degrees.floor();
    let width = if decimals > 0 { decimals + 3 } else { 2 };
    format!("{whole:0figures$.0}{:0width$.decimals$}", (degrees - whole) * 60.0)
}

pub fn igc() -> String {
    let row = |second| {
        let (lat, lon, height) = place(second);
        let (lat, lon) = (minutes(lat, 2, 3).replace('.', ""), minutes(lon, 3, 3).replace('.', ""));
        format!("B0900{second:02}{lat}N{lon}EA{:05.0}{height:05.0}00312\r\n", height - 20.0)
    };
    let head = "AXXX001\r\nHFDTEDATE:150724,01\r\nHFALGALTGPS:GEO\r\nI013638FXA\r\n";
    text(head, row, "LXXXend\r\n")
}

pub fn gpx() -> String {
    let row = |second| {
        let (lat, lon, height) = place(second);
        format!(
            "<trkpt lat=\"{lat:.6}\" lon=\"{lon:.6}\"><ele>{height:.1}</ele>\
             <time>2024-07-15T09:00:{second:02}Z</time></trkpt>\n"
        )
    };
    let head = "<?xml version=\"1.0\"?>\n<gpx version=\"1.1\"><trk><name>&amp;</name><trkseg>\n";
    text(head, row, "</trkseg></trk></gpx>\n")
}

pub fn kml() -> String {
    let row = |second| {
        let (lat, lon, height) = place(second);
        format!(
            "<when>2024-07-15T09:00:{second:02}Z</when>\n\
             <gx:coord>{lon:.6} {lat:.6} {height:.1}</gx:coord>\n<gx:angles>340 3 0</gx:angles>\n"
        )
    };
    let head = "<?xml version=\"1.0\"?>\n<kml><Placemark><gx:Track>\n\
                <altitudeMode>absolute</altitudeMode>\n";
    text(head, row, "</gx:Track></Placemark></kml>\n")
}

pub fn placemarks() -> String {
    let row = |second| {
        let (lat, lon, height) = place(second);
        format!(
            "<Placemark><TimeStamp><when>2024-07-15T09:00:{second:02}Z</when></TimeStamp><Point>\n\
             <altitudeMode>absolute</altitudeMode>\n\
             <coordinates>{lon:.6},{lat:.6},{height:.1}</coordinates></Point></Placemark>\n"
        )
    };
    text("<kml><Document>\n", row, "</Document></kml>\n")
}

pub fn fdr_4() -> String {
    let row = |second| {
        let (lat, lon, height) = place(second);
        format!("09:00:{second:02}.00, {lon:.7}, {lat:.7}, {:.2}, 340, 3, 0\n", height / 0.3048)
    };
    text("A\n4\n\nACFT, a.acf\nTAIL, N1\nDATE, 07/15/2024\n\n", row, "")
}

pub fn fdr_3() -> String {
    let row = |second| {
        let (lat, lon, height) = place(second);
        let feet = height / 0.3048;
        format!("DATA,{second},15,{lon:.7},{lat:.7},{feet:.2},500,0,0,0,3,0,340,90,0,0,\r")
    };
    text("I\r3\rCOMM,old\rTIME,09:00:00\rDATE,07/15/24\r", row, "")
}

pub fn acmi() -> String {
    let row = |second| {
        let (lat, lon, height) = place(second);
        let first = if second == 0 { ",Name=Glider\\, red,Type=Air+FixedWing" } else { "" };
        let (lat, lon) = (lat - 46.0, lon - 11.0);
        format!("#{second}\na1,T={lon:.7}|{lat:.7}|{height:.2}|0|3|340{first}\n")
    };
    let head = "\u{FEFF}FileType=text/acmi/tacview\nFileVersion=2.2\n\
                0,ReferenceTime=2024-07-15T09:00:00Z\n0,ReferenceLongitude=11\n\
                0,ReferenceLatitude=46\n";
    text(head, row, "-a1\n")
}

pub fn nmea() -> String {
    let row = |second| {
        let (lat, lon, height) = place(second);
        let (lat, lon) = (minutes(lat, 2, 5), minutes(lon, 3, 5));
        let gga =
            format!("GPGGA,0900{second:02}.00,{lat},N,{lon},E,1,9,0.8,{height:.1},M,48.5,M,,");
        let rmc = format!("GPRMC,0900{second:02}.00,A,{lat},N,{lon},E,50.0,340.0,150724,,");
        let sum = |body: &str| body.bytes().fold(0_u8, |sum, byte| sum ^ byte);
        format!("${gga}*{:02X}\r\n${rmc}*{:02X}\r\n", sum(&gga), sum(&rmc))
    };
    text("", row, "")
}

pub fn flightgear() -> String {
    let row = |second| {
        let (lat, lon, height) = place(second);
        format!("{second},{lat:.7},{lon:.7},{:.3},0,3,340\n", height / 0.3048)
    };
    let head =
        "elapsed-sec,latitude-deg,longitude-deg,altitude-ft,roll-deg,pitch-deg,heading-deg\n";
    text(head, row, "")
}

pub fn adsb_csv() -> String {
    let row = |second| {
        let (lat, lon, height) = place(second);
        let feet = (height / 0.3048 / 25.0).round() * 25.0;
        format!("{},3c6444,DLH1,{lat:.5},{lon:.5},{feet:.0}\n", 1_721_034_000 + second)
    };
    text("timestamp,icao24,callsign,latitude,longitude,altitude\n", row, "")
}

pub fn adsb_json() -> String {
    let row = |second| {
        let (lat, lon, height) = place(second);
        let comma = if second == 0 { "" } else { "," };
        format!(
            "{comma}\n{{\"timestamp\": {}, \"icao24\": \"3c6444\", \"latitude\": {lat:.5}, \
             \"longitude\": {lon:.5}, \"altitude\": {:.0}}}",
            1_721_034_000 + second,
            height / 0.3048
        )
    };
    text("[", row, "\n]\n")
}

pub fn trace_json() -> String {
    let row = |second| {
        let (lat, lon, height) = place(second);
        let comma = if second == 0 { "" } else { "," };
        let feet = height / 0.3048;
        format!(
            "{comma}\n[{second}.5,{lat:.5},{lon:.5},{feet:.0},90,340,0,600,null,\"adsb\",{feet:.0}]"
        )
    };
    text("{\"icao\":\"3c6444\",\"timestamp\":1721034000.0,\"trace\":[", row, "\n]}\n")
}

pub fn own_csv() -> String {
    let row = |second| {
        let (lat, lon, height) = place(second);
        format!("2024-07-15T09:00:{second:02}.000Z,{lat:.8},{lon:.8},{height:.3},340,3,0\n")
    };
    text("utc,lat_deg,lon_deg,alt_msl_m,heading_deg,pitch_deg,roll_deg\n", row, "")
}

/// For [`untitled`].
pub const MAP: &str = "\
Columns(
    separator: ';',
    titles: false,
    time: (column: 1, unit: Seconds),
    latitude: 2,
    longitude: 3,
    altitude: (column: 4, unit: Feet, datum: Some(Msl)),
    angles: Radians,
)
";

pub fn untitled() -> String {
    let row = |second| {
        let (lat, lon, height) = place(second);
        let (lat, lon) = (lat.to_radians(), lon.to_radians());
        format!("{second};{lat:.9};{lon:.9};{:.2}\n", height / 0.3048)
    };
    text("", row, "")
}

/// A zip archive with one file.
pub fn zipped(name: &str, text: &str) -> Vec<u8> {
    let mut writer = zip::ZipWriter::new(Cursor::new(Vec::new()));
    writer.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
    std::io::Write::write_all(&mut writer, text.as_bytes()).unwrap();
    writer.finish().unwrap().into_inner()
}

/// A copy of a text with one line changed; lines count from 1.
pub fn with_line(text: &str, number: usize, line: &str) -> String {
    let mut changed = String::new();
    for (i, old) in text.lines().enumerate() {
        writeln!(changed, "{}", if i + 1 == number { line } else { old }).unwrap();
    }
    changed
}
