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

pub fn fdr_1() -> String {
    let row = |second| {
        let (lat, lon, height) = place(second);
        let feet = height / 0.3048;
        let rest = "0,".repeat(65);
        format!("DATA,{second},15,{lon:.7},{lat:.7},{feet:.2},500,0,0,0,3,0,340,{rest}\r")
    };
    text("A\r1\rTAIL,N1,\rTIME,09:00:00,\rDATE,07/15/24,\rCALI,11.25,46.5,6500,\r", row, "")
}

pub fn fdr_3() -> String {
    let row = |second| {
        let (lat, lon, height) = place(second);
        let feet = height / 0.3048;
        format!("DATA,{second},{lon:.7},{lat:.7},{feet:.2},340,3,0,29.92,6500\r\n")
    };
    let head = "I\r\n3 and some words about it\r\nCOMM,x\r\nTIME,09:00:00\r\nDATE,07/15/24\r\n\
                DREF,sim/some/thing\t1.0\t// that\r\nDREF,sim/other\t0.5\r\n";
    text(head, row, "")
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

pub fn base_station() -> String {
    let row = |second| {
        let (lat, lon, height) = place(second);
        let time = format!("2024/07/15,09:00:{second:02}.000");
        let line = |kind, rest| format!("MSG,{kind},1,1,3C6444,1,{time},{time},{rest}\n");
        line(1, "DLH1,,,,,,,,0,,0,0".to_owned())
            + &line(3, format!(",{:.0},,,{lat:.5},{lon:.5},,,0,0,0,0", height / 0.3048))
            + &line(4, ",,55,340,,,600,,0,0,0,0".to_owned())
    };
    text("STA,,5,1,3C6444,1,2024/07/15,09:00:00.000,2024/07/15,09:00:00.000,OK\n", row, "")
}

/// readsb's `aircraft.json`, one a second: places are 1.5 s old.
pub fn snapshots() -> String {
    let row = |second| {
        let (lat, lon, height) = place(second);
        format!(
            "{{\"now\":{:.1},\"messages\":1,\"aircraft\":[{{\"hex\":\"3c6444\",\"alt_baro\":{:.0},\
             \"lat\":{lat:.6},\"lon\":{lon:.6},\"seen_pos\":1.5}},{{\"hex\":\"4ca2d6\",\"seen\":3}}]}}\n",
            1_721_034_001.5 + f64::from(second),
            height / 0.3048
        )
    };
    text("", row, "")
}

/// OpenSky's states, one answer a second: the place is that of the time before it.
pub fn states() -> String {
    let row = |second| {
        let (lat, lon, height) = place(second);
        let at = 1_721_034_000 + second;
        format!(
            "{{\"time\":{},\"states\":[[\"3c6444\",\"DLH1\",\"Germany\",{at},{at},{lon:.5},{lat:.5},\
             {height:.1},false,50,340,3,null,null,\"1000\",false,0]]}}\n",
            at + 4
        )
    };
    text("", row, "")
}

/// A table as pandas writes it: columns of rows by number.
pub fn columns_json() -> String {
    let column = |name: &str, value: &dyn Fn(u32) -> String| {
        let rows: Vec<_> = (0..SECONDS).map(|i| format!("\"{i}\":{}", value(i))).collect();
        format!("\"{name}\":{{{}}}", rows.join(","))
    };
    let columns = [
        column("timestamp", &|i| (1_721_034_000_000 + 1000 * u64::from(i)).to_string()),
        column("icao24", &|_| "\"3c6444\"".to_owned()),
        column("latitude", &|i| format!("{:.6}", place(i).0)),
        column("longitude", &|i| format!("{:.6}", place(i).1)),
        column("altitude", &|i| format!("{:.1}", place(i).2 / 0.3048)),
    ];
    format!("{{{}}}\n", columns.join(","))
}

/// A line with its times beside it, as programs for competitions take it.
pub fn gps_dump() -> String {
    let seconds: String = (0..SECONDS).map(|second| format!("{second} ")).collect();
    let row = |second| {
        let (lat, lon, height) = place(second);
        format!("{lon:.6},{lat:.6},{height:.0} ")
    };
    let head = format!(
        "<kml><Folder><Placemark><Metadata src=\"x\" type=\"track\">\n\
         <FsInfo time_of_first_point=\"2024-07-15T09:00:00Z\"><SecondsFromTimeOfFirstPoint>\n\
         {seconds}</SecondsFromTimeOfFirstPoint></FsInfo></Metadata><LineString>\n\
         <altitudeMode>absolute</altitudeMode><coordinates>\n"
    );
    text(&head, row, "</coordinates></LineString></Placemark></Folder></kml>\n")
}

/// A track whose angles stand in arrays of their own, and views and lines that mean the ground.
pub fn arrays_kml() -> String {
    let array = |name: &str, value: &str| {
        let values = format!("<gx:value>{value}</gx:value>").repeat(12);
        format!("<gx:SimpleArrayData name=\"{name}\">{values}</gx:SimpleArrayData>\n")
    };
    let row = |second| {
        let (lat, lon, height) = place(second);
        format!(
            "<when>2024-07-15T09:00:{second:02}.000Z</when>\n\
             <gx:coord>{lon:.6} {lat:.6} {height:.1}</gx:coord>\n"
        )
    };
    let head = "<kml><Placemark><LineString><altitudeMode>clampToGround</altitudeMode>\n\
                <coordinates>11,46,0 11,47,0</coordinates></LineString></Placemark>\n\
                <Placemark><LookAt><gx:TimeStamp><when>2024-07-15</when></gx:TimeStamp>\n\
                <altitudeMode>relativeToGround</altitudeMode></LookAt><gx:MultiTrack>\n\
                <altitudeMode>absolute</altitudeMode><gx:Track>\n";
    let arrays = array("course", "340") + &array("pitch", "3") + &array("bank", "-7");
    let tail = "</gx:Track></gx:MultiTrack></Placemark></kml>\n";
    text(head, row, &(arrays + tail))
}

/// Titles of the flight come first, then those of the fixes.
pub fn foreflight() -> String {
    let row = |second| {
        let (lat, lon, height) = place(second);
        let feet = height / 0.3048;
        format!("1.7210340{second:02}000E9,{lat:.9},{lon:.9},{feet:.4},340.0,97.2,-7.0,3.0,2.0\n")
    };
    let head = "Pilot,Tail Number,Start Latitude,Start Time,Battery State\n\
                \"\",\"N1\",46.5,1721034000000,\"iOS\"\n\
                Timestamp,Latitude,Longitude,Altitude,Course,Speed,Bank,Pitch,Vertical Error\n";
    text(head, row, "")
}

/// Garmin's G1000: date, time and zone apart, units above the titles.
pub fn g1000() -> String {
    let row = |second| {
        let (lat, lon, height) = place(second);
        let feet = height / 0.3048;
        format!(
            "2024-07-15, 11:00:{second:02},  +02:00, {lat:12.7}, {lon:12.7}, 6543.2, {feet:7.1}, 3.0, -7.0, 328.5,   11.5\r\n"
        )
    };
    let head = "#airframe_info, log_version=\"1.00\"\r\n\
                #yyy-mm-dd, hh:mm:ss, hh:mm, degrees, degrees, ft Baro, ft msl, deg, deg, deg, deg\r\n  \
                Lcl Date, Lcl Time, UTCOfst, Latitude, Longitude, AltB, AltMSL, Pitch, Roll, HDG, MagVar\r\n        \
                , , , , , , , , , ,\r\n";
    text(head, row, "")
}

pub fn semicolons() -> String {
    let row = |second| {
        let (lat, lon, height) = place(second);
        format!("2024-07-15 09:00:{second:02};{lat:.6};{lon:.6};{height:.1}\n").replace('.', ",")
    };
    text("utc;lat_deg;lon_deg;alt_msl_m\n", row, "")
}

/// Positions without heights, and the pressure altitude that an instrument says beside them; with
/// the times of a terminal.
pub fn terminal() -> String {
    let sentence = |second: u32, body: String| {
        let sum = body.bytes().fold(0_u8, |sum, byte| sum ^ byte);
        format!("[11:00:{second:02}.123] ${body}*{sum:02X}\n")
    };
    let row = |second| {
        let (lat, lon, height) = place(second);
        let (lat, lon) = (minutes(lat, 2, 5), minutes(lon, 3, 5));
        let rmc = format!("GNRMC,0900{second:02}.00,A,{lat},N,{lon},E,50.0,340.0,150724,,");
        sentence(second, rmc) + &sentence(second, format!("PGRMZ,{:.0},f,3", height / 0.3048))
    };
    text("", row, "")
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

/// The bytes as a gzip file.
pub fn gzipped(bytes: &[u8]) -> Vec<u8> {
    let mut writer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    std::io::Write::write_all(&mut writer, bytes).unwrap();
    writer.finish().unwrap()
}

/// A text as UTF-16, its low bytes first, with a mark of their order or without.
pub fn utf_16(text: &str, mark: &str) -> Vec<u8> {
    let units = mark.encode_utf16().chain(text.encode_utf16());
    units.flat_map(u16::to_le_bytes).collect()
}

/// A copy of a text with one line changed; lines count from 1.
pub fn with_line(text: &str, number: usize, line: &str) -> String {
    let mut changed = String::new();
    for (i, old) in text.lines().enumerate() {
        writeln!(changed, "{}", if i + 1 == number { line } else { old }).unwrap();
    }
    changed
}
