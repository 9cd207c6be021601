//! `overfly serve`: answers other simulators over UDP, as an image generator does.
//!
//! In:    a scene, ports, whom to answer.
//! Out:   a session until it is ended; a table of what came and what was answered.
//! Keeps: nothing.
//! Not here: the frames (`session`), sockets (`sockets`), the protocols (`overfly_link`).

mod places;
mod session;
mod sockets;

use super::replay::{default_workers, parse_size};
use super::trade::stop_on_ctrl_c;
use super::{Failure, INTERRUPTED, place_of, read_by};
use crate::viewer::session::scene_of;
use clap::ArgGroup;
use overfly::core::datasource::facts::Datum;
use overfly::core::geodesy::Ellipsoid;
use overfly::core::ground::LEVEL_MAX;
use overfly::core::settings::SceneSettings;
use overfly::ingest::geoid::Geoid;
use overfly::sources::{Sources, level_of};
use overfly_link::cigi::{Lens, MESSAGE_BYTES, Setup};
use session::{Plan, SeaLevel, Session};
use sockets::Sockets;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, ToSocketAddrs};
use std::path::PathBuf;
use std::process::ExitCode;

/// Frames a second.
const RATES_HZ: [f64; 2] = [1.0, 1000.0];

const MORE: &str = "\
CIGI 3.3 (and 3.2): IG Control, Entity Control, Conformal Clamped Entity Control, View Control, View
Definition and Earth Reference Model Definition are acted upon; HAT/HOT Requests and both Line of
Sight Requests are answered, once or every nth frame; each frame begins with Start Of Frame. Views
are served, not shown: --record keeps them for `overfly replay --stills` and `overfly view`.
Ctrl-C ends it with a table of what came, what was dropped and why, and what was answered.
docs/serving.md has every field, the coordinates and the limits. The protocols know no passwords:
whoever reaches a port can steer.

Examples:
  overfly serve --cigi 8004
  overfly serve --cigi 8004 --reply-to 127.0.0.1:8005 --scene alps.ron --rate 60
  overfly serve --fgfs-native-fdm 5503 --record flown.ovf
  overfly serve --cigi 8004 --bind 192.168.7.2 --reply-to 192.168.7.1:8005";

/// What `serve` takes.
#[derive(clap::Args)]
#[command(after_help = MORE,
          group(ArgGroup::new("links").required(true).multiple(true)
                .args(["cigi", "fgfs_native_fdm"])))]
pub struct Arguments {
    /// Answers CIGI 3.3 on this UDP port; 0 takes any that is free and says which.
    #[arg(long, value_name = "PORT")]
    cigi: Option<u16>,
    /// Takes FlightGear's native FDM packets, versions 24 and 25, on this UDP port: they fly the
    /// ownship. As from `fgfs --native-fdm=socket,out,60,127.0.0.1,PORT,udp`.
    #[arg(long, value_name = "PORT")]
    fgfs_native_fdm: Option<u16>,
    /// A scene file or a preset (earth, moon, small).
    #[arg(long, default_value = "earth")]
    scene: String,
    /// Address to listen on. Any but 127.0.0.1 and ::1 lets other machines steer.
    #[arg(long, value_name = "ADDRESS", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    bind: IpAddr,
    /// Sends every frame there, from the first on, and takes CIGI from that host alone. Without
    /// it the answers go to whoever sent the last message.
    #[arg(long, value_name = "HOST:PORT", value_parser = parse_address, requires = "cigi")]
    reply_to: Option<SocketAddr>,
    /// Frames a second, 1 to 1000.
    #[arg(long, value_name = "HZ", value_parser = parse_rate, default_value = "60")]
    rate: f64,
    /// Size of each view's picture in pixels: it says how fine the ground must be.
    #[arg(long, value_name = "WxH", value_parser = parse_size, default_value = "1280x720")]
    size: [u32; 2],
    /// The scene's database number, 1 to 127. [default: 0, the host need not load one]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(i8).range(1..))]
    database: Option<i8>,
    /// What altitudes are above: `msl` is the geoid EGM96, `auto` is that where the scene has data
    /// above EGM96, else the ellipsoid.
    #[arg(long, value_enum, default_value = "auto")]
    altitude: Altitude,
    /// Lattice level whose heights are the answers, 0 to 56. [default: that of the scene's finest
    /// data; without data, samples 1 m apart]
    #[arg(long, value_name = "N",
          value_parser = clap::value_parser!(u8).range(..=i64::from(LEVEL_MAX)))]
    level: Option<u8>,
    /// Most bytes of a message to the host, 256 to 65507; what does not fit waits a frame.
    #[arg(long, value_name = "BYTES", value_parser = parse_message, default_value = "8192")]
    datagram: usize,
    /// Ends after N frames.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    frames: Option<u64>,
    /// Records views, page arrivals and digests of every frame, for `overfly replay`.
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Worker threads beside the main one, 0 to 64.
    #[arg(long, value_parser = clap::value_parser!(u8).range(0..=64))]
    workers: Option<u8>,
}

/// What altitudes are above.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Altitude {
    /// As the scene's data are.
    Auto,
    /// Mean sea level, by the geoid EGM96.
    Msl,
    /// The ellipsoid.
    Ellipsoid,
}

fn parse_address(text: &str) -> Result<SocketAddr, String> {
    let found = text.to_socket_addrs().ok().and_then(|mut all| all.next());
    found.filter(|address| address.port() != 0).ok_or_else(|| {
        format!("`{text}` is not HOST:PORT with a host that is known and a port from 1 to 65535")
    })
}

fn parse_rate(text: &str) -> Result<f64, String> {
    let [least, most] = RATES_HZ;
    let rate = text.parse().ok().filter(|rate| (least..=most).contains(rate));
    rate.ok_or_else(|| format!("`{text}` is not a number from {least} to {most}"))
}

fn parse_message(text: &str) -> Result<usize, String> {
    let [least, most] = MESSAGE_BYTES;
    let bytes = text.parse().ok().filter(|bytes| (least..=most).contains(bytes));
    bytes.ok_or_else(|| format!("`{text}` is not a whole number from {least} to {most}"))
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let mut taken = read_by([Some(&arguments.scene)]);
    let record = arguments.record.as_deref().map(|path| place_of(path, &mut taken)).transpose()?;
    let (scene_text, scene) = scene_of(&arguments.scene)?;
    let ports = [arguments.cigi, arguments.fgfs_native_fdm];
    let sockets = Sockets::bind(arguments.bind, ports, arguments.reply_to)?;
    if !arguments.bind.is_loopback() {
        let bind = arguments.bind;
        eprintln!("overfly: bound to {bind}: whoever reaches it can steer what is served");
    }
    let workers = arguments.workers.map_or_else(default_workers, usize::from);
    let mut session = Session::open(Plan {
        setup: setup(arguments, &scene),
        scene_text,
        scene,
        workers,
        sockets,
        rate_hz: arguments.rate,
        size_px: arguments.size,
        record,
    })?;
    let sources = session.sources();
    let level = arguments.level.unwrap_or_else(|| finest_level(sources));
    let (sea_level, above) = sea_level(arguments.altitude, sources);
    for (name, at) in session.addresses() {
        say!("{name} on {at}");
    }
    say!(
        "scene {}, {} Hz, heights of lattice level {level}, altitudes above {above}",
        arguments.scene,
        arguments.rate
    );
    session.answer_from(level, sea_level);
    let stop = stop_on_ctrl_c()?;
    let ran = session.run(&stop, arguments.frames);
    // Also where a frame failed what came until then is told.
    session.table().iter().for_each(|(name, count)| say!("{name:<30}{count:>12}"));
    session.close()?;
    let whole = ran?;
    Ok(if whole || arguments.frames.is_none() {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(INTERRUPTED)
    })
}

fn setup(arguments: &Arguments, scene: &SceneSettings) -> Setup {
    let lenses = scene.views.iter().map(|lens| Lens {
        field_of_view_rad: lens.field_of_view.0,
        yaw_rad: lens.yaw.0,
        pitch_rad: lens.pitch.0,
        near_m: lens.near_m,
    });
    Setup {
        lenses: lenses.collect(),
        database: arguments.database,
        message_bytes: arguments.datagram,
    }
}

/// The level of the finest data that a scene has anywhere; the planet's at about 1 m without any.
fn finest_level(sources: &Sources) -> u8 {
    let layers = sources.archives().iter().flat_map(|archive| &archive.facts().layers);
    let finest = layers.map(|layer| level_of(layer.depth)).max();
    finest.unwrap_or_else(|| sources.procedural_level())
}

/// What altitudes count from, and in words.
fn sea_level(altitude: Altitude, sources: &Sources) -> (SeaLevel, &'static str) {
    let is_msl = match altitude {
        Altitude::Msl => true,
        Altitude::Ellipsoid => false,
        Altitude::Auto => {
            let earth = sources.body().a_m == Ellipsoid::WGS84.a_m;
            let above_geoid =
                |archive: &overfly::archive::Archive| archive.facts().datum == Datum::Egm96;
            earth && sources.archives().iter().any(above_geoid)
        }
    };
    if is_msl {
        (SeaLevel::Geoid(Box::new(Geoid::egm96())), "the geoid EGM96")
    } else {
        (SeaLevel::Ellipsoid, "the ellipsoid")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_rates_and_sizes_are_read_and_refused_with_their_ranges() {
        let address = parse_address("127.0.0.1:8005").unwrap();
        assert_eq!((address.ip().is_loopback(), address.port()), (true, 8005));
        for text in ["", "8005", "127.0.0.1", "127.0.0.1:0", "127.0.0.1:70000"] {
            assert!(parse_address(text).unwrap_err().contains("HOST:PORT"), "{text}");
        }
        assert_eq!(parse_rate("59.94"), Ok(59.94));
        for text in ["0", "1001", "NaN", "fast"] {
            assert!(parse_rate(text).unwrap_err().contains("from 1 to 1000"), "{text}");
        }
        assert_eq!(parse_message("1472"), Ok(1472));
        for text in ["255", "65508", "-1", "x"] {
            assert!(parse_message(text).unwrap_err().contains("from 256 to 65507"), "{text}");
        }
    }
}
