//! XML as GPX and KML need it: begins, texts and ends of elements, each with its place.
//!
//! In:    a text.
//! Out:   [`Step`]s; a fault where it is no XML, unless it only ends too early.
//! Keeps: the text of the element that is open.
//! Not here: what the elements mean (`gpx`, `kml`).
//!
//! By quick-xml rather than the crates `gpx` and `kml`: those give no line and column, and `kml`
//! knows no `gx:Track`.

use crate::fault::{TrackError, Wrong};
use crate::fixes::Sink;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

/// Elements within elements that are followed; no file of flights comes near.
const DEPTH_MAX: usize = 256;

/// What comes next in a file.
pub(crate) enum Step<'e> {
    /// An element begins; its attributes by name.
    Begin(&'e str, &'e [(String, String)]),
    /// An element ends; its text with the offset at which that begins.
    End(&'e str, &'e str, usize),
}

/// Walks through the elements. `step` gets the sink, what comes, and its offset.
pub(crate) fn walk<'a>(
    sink: &mut Sink<'a>,
    mut step: impl FnMut(&mut Sink<'a>, Step<'_>, usize) -> Result<(), TrackError>,
) -> Result<(), TrackError> {
    let mut reader = Reader::from_str(sink.text.all);
    let mut content = String::new();
    let mut content_at = 0;
    let mut depth = 0_usize;
    loop {
        let at = offset(reader.buffer_position());
        let event = match reader.read_event() {
            Ok(event) => event,
            Err(error) => {
                let at = offset(reader.error_position());
                return broken(sink, at, &error.to_string());
            }
        };
        match event {
            Event::Start(element) | Event::Empty(element) if depth >= DEPTH_MAX => {
                let name = element.local_name().into_inner().to_owned();
                return broken(sink, at, &format!("{name} lies within {depth} elements"));
            }
            Event::Start(element) => {
                depth += 1;
                content.clear();
                let attributes = attributes_of(&element);
                step(sink, Step::Begin(element.local_name().into_inner(), &attributes), at)?;
            }
            Event::Empty(element) => {
                let attributes = attributes_of(&element);
                let name = element.local_name().into_inner();
                step(sink, Step::Begin(name, &attributes), at)?;
                step(sink, Step::End(name, "", at), at)?;
            }
            Event::End(element) => {
                depth = depth.saturating_sub(1);
                let name = element.local_name().into_inner();
                step(sink, Step::End(name, content.trim(), content_at), at)?;
                content.clear();
            }
            Event::Text(text) => add(&mut content, &mut content_at, &text.xml10_content(), at),
            Event::CData(text) => add(&mut content, &mut content_at, &text.xml10_content(), at),
            Event::Eof if depth > 0 => return broken(sink, at, "it ends within an element"),
            Event::Eof => return Ok(()),
            _ => {}
        }
    }
}

fn add(content: &mut String, content_at: &mut usize, text: &str, at: usize) {
    if content.is_empty() {
        let blank = text.len() - text.trim_start().len();
        *content_at = at + blank;
    }
    content.push_str(text);
}

fn offset(position: u64) -> usize {
    usize::try_from(position).unwrap_or(usize::MAX)
}

/// Attributes that can be read; others lack, which who needs them will say.
fn attributes_of(element: &BytesStart<'_>) -> Vec<(String, String)> {
    let attributes = element.attributes().filter_map(Result::ok);
    let pair = |attribute: quick_xml::events::attributes::Attribute<'_>| {
        let name = attribute.key.local_name().into_inner().to_owned();
        (name, attribute.value.into_owned())
    };
    attributes.map(pair).collect()
}

/// XML that goes on no more. What was read before stays where it is most of the file.
fn broken(sink: &mut Sink<'_>, at: usize, why: &str) -> Result<(), TrackError> {
    let all = sink.text.all;
    let at = at.min(all.len());
    let rest = all.get(at..).unwrap_or("").lines().next().unwrap_or("");
    let wrong = Wrong::new(at, "XML", rest, format!("well-formed XML ({why})"));
    // Of a file that breaks off, that is the only fault; what it has is worth having.
    if all.len() - at > all.len() / 10 && sink.fixes.track.len() < 10 {
        return Err(TrackError::Fault(sink.text.fault(wrong)));
    }
    sink.bad(wrong);
    Ok(())
}
