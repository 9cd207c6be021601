//! Loader threads: turn wanted page keys into pages, beside the frame.
//!
//! In:    keys from `FrameOutput::wanted`, or from a recording.
//! Out:   pages for `FrameInput::arrived`; which pages failed or lack their colour, and why.
//! Keeps: threads, what is in flight, failures and when to try again.
//! Not here: which pages are wanted (`overfly_core::lod`), making one (`sources`).

use crate::sources::{SourceError, Sources};
use crossbeam::channel::{Receiver, Sender, unbounded};
use overfly_core::datasource::{Page, PageKey};
use overfly_jobs::now_ns;
use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

/// A page that failed is asked for again after this time, then after twice as long, and so on.
const WAIT_LEAST_NS: u64 = 500_000_000;
const WAIT_MOST_NS: u64 = 30_000_000_000;
/// No more failures than this are remembered.
const FAILURES_MAX: usize = 4096;

/// A page, and why it lacks its colour if it does; or why there is none.
type Outcome = Result<(Arc<Page>, Option<SourceError>), SourceError>;

/// The threads, and what is in flight.
///
/// Dropping it waits for the tiles that its threads are reading. Where a server may be silent, call
/// [`Sources::close`] before.
pub struct Loader {
    jobs: Option<Sender<PageKey>>,
    done: Receiver<(PageKey, Outcome)>,
    threads: Vec<JoinHandle<()>>,
    stops: Arc<AtomicBool>,
    in_flight: BTreeSet<PageKey>,
    /// Pages that are ready and wait for their time or their turn.
    ready: BTreeMap<PageKey, Arc<Page>>,
    /// Pages that could not be made when they were last asked for.
    failed: BTreeMap<PageKey, Failure>,
    /// Pages that came without the colour that they should have, when they were last made.
    colourless: BTreeMap<PageKey, SourceError>,
    /// Live arrivals: keys in the order asked for, with the time before which they stay away.
    due: Vec<(PageKey, u64)>,
}

struct Failure {
    error: SourceError,
    wait_ns: u64,
    again_ns: u64,
}

impl Loader {
    /// Starts `threads` loader threads, at least one.
    ///
    /// # Errors
    /// If the system refuses a thread.
    pub fn new(sources: Arc<Sources>, threads: usize) -> std::io::Result<Self> {
        let (jobs, todo) = unbounded::<PageKey>();
        let (finished, done) = unbounded();
        let stops = Arc::new(AtomicBool::new(false));
        let start = |index| {
            let (todo, finished) = (todo.clone(), finished.clone());
            let (sources, stops) = (sources.clone(), stops.clone());
            let name = format!("loader {index}");
            std::thread::Builder::new()
                .name(name)
                .spawn(move || serve(&todo, &finished, &sources, &stops))
        };
        let threads = (0..threads.max(1)).map(start).collect::<Result<_, _>>()?;
        Ok(Self {
            jobs: Some(jobs),
            done,
            threads,
            stops,
            in_flight: BTreeSet::new(),
            ready: BTreeMap::new(),
            failed: BTreeMap::new(),
            colourless: BTreeMap::new(),
            due: Vec::new(),
        })
    }

    /// Waits for exactly these pages and appends them in this order; all but those that fail, or
    /// failed a moment ago.
    pub fn fetch(&mut self, keys: &[PageKey], arrived: &mut Vec<Arc<Page>>) {
        keys.iter().for_each(|&key| self.ask(key));
        for &key in keys {
            while self.in_flight.contains(&key) {
                let (done, outcome) =
                    self.done.recv().expect("loader threads live as long as the loader");
                self.put(done, outcome);
            }
            arrived.extend(self.ready.remove(&key));
        }
    }

    /// Asks for pages that shall arrive when ready, `delay_ms` from now at the earliest; those in
    /// flight that nobody wants any more are forgotten when they come.
    pub fn request(&mut self, wanted: &[PageKey], delay_ms: u64) {
        let due_ns = now_ns() + delay_ms * 1_000_000;
        self.due.retain(|(key, _)| wanted.contains(key));
        for &key in wanted {
            if self.due.iter().all(|&(known, _)| known != key) {
                self.due.push((key, due_ns));
                self.ask(key);
            }
        }
    }

    /// Appends what was requested, is ready and due, in the order of the requests. What failed is
    /// tried again, first after half a second, then after twice as long each time, up to 30 s.
    pub fn collect(&mut self, arrived: &mut Vec<Arc<Page>>) {
        while let Ok((key, outcome)) = self.done.try_recv() {
            self.put(key, outcome);
        }
        if !self.failed.is_empty() {
            (0..self.due.len()).for_each(|at| self.ask(self.due[at].0));
        }
        let now = now_ns();
        let ready = &mut self.ready;
        self.due.retain(|&(key, due_ns)| {
            let page = if due_ns <= now { ready.remove(&key) } else { None };
            let stays = page.is_none();
            arrived.extend(page);
            stays
        });
        let due = &self.due;
        ready.retain(|key, _| due.iter().any(|(wanted, _)| wanted == key));
    }

    /// Pages that could not be made when they were last asked for, or lack their colour, and why.
    pub fn faults(&self) -> impl Iterator<Item = (PageKey, &SourceError)> {
        let failed = self.failed.iter().map(|(&key, failure)| (key, &failure.error));
        failed.chain(self.colourless.iter().map(|(&key, error)| (key, error)))
    }

    /// Whether a page failed so lately that it is not yet asked for again.
    pub fn rests(&self, key: PageKey) -> bool {
        self.failed.get(&key).is_some_and(|failure| now_ns() < failure.again_ns)
    }

    fn ask(&mut self, key: PageKey) {
        if !self.ready.contains_key(&key) && !self.rests(key) && self.in_flight.insert(key) {
            let jobs = self.jobs.as_ref().expect("open until dropped");
            jobs.send(key).expect("loader threads live as long as the loader");
        }
    }

    fn put(&mut self, key: PageKey, outcome: Outcome) {
        self.in_flight.remove(&key);
        match outcome {
            Ok((page, fault)) => {
                self.failed.remove(&key);
                self.colourless.remove(&key);
                self.note_colourless(key, fault);
                self.ready.insert(key, page);
            }
            Err(error) => self.note(key, error),
        }
    }

    fn note_colourless(&mut self, key: PageKey, fault: Option<SourceError>) {
        let Some(error) = fault else { return };
        if self.colourless.len() >= FAILURES_MAX {
            self.colourless.pop_first();
        }
        self.colourless.insert(key, error);
    }

    fn note(&mut self, key: PageKey, error: SourceError) {
        let before = self.failed.get(&key).map_or(0, |failure| failure.wait_ns);
        let wait_ns = (2 * before).clamp(WAIT_LEAST_NS, WAIT_MOST_NS);
        let again_ns = now_ns() + wait_ns;
        if self.failed.len() >= FAILURES_MAX {
            self.failed.pop_first();
        }
        self.failed.insert(key, Failure { error, wait_ns, again_ns });
    }
}

/// Makes pages until there is nobody left to ask or to answer.
fn serve(
    todo: &Receiver<PageKey>,
    finished: &Sender<(PageKey, Outcome)>,
    sources: &Sources,
    stops: &AtomicBool,
) {
    for key in todo {
        // Whoever waits for this page must hear of it, also where a bug of ours ends it.
        let made = catch_unwind(AssertUnwindSafe(|| sources.coloured_page(key)));
        let outcome = made.unwrap_or_else(|panic| {
            let text = panic.downcast_ref::<String>().map(String::as_str);
            let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
            let message = text.unwrap_or("a panic without words").to_owned();
            Err(SourceError::Panic { key, message })
        });
        if finished.send((key, outcome)).is_err() || stops.load(Ordering::Relaxed) {
            break;
        }
    }
}

impl Drop for Loader {
    fn drop(&mut self) {
        self.stops.store(true, Ordering::Relaxed);
        self.jobs = None;
        for thread in self.threads.drain(..) {
            // A loader thread that panicked has said so; there is nobody left to tell.
            let _ = thread.join();
        }
    }
}

#[cfg(all(test, feature = "ingest"))]
mod tests {
    use super::*;
    use crate::core::settings::{SceneSettings, SourceSettings};
    use crate::ingest::{ImageryOptions, build_imagery};

    fn loader() -> Loader {
        let scene = overfly_config::load("small").unwrap();
        let sources = Sources::open(&scene, &crate::archive::OpenOptions::default()).unwrap();
        Loader::new(Arc::new(sources), 2).unwrap()
    }

    #[test]
    fn fetched_pages_come_in_the_order_asked_for() {
        let keys = [3, 1, 0, 2].map(PageKey::root);
        let mut arrived = Vec::new();
        loader().fetch(&keys, &mut arrived);
        assert_eq!(arrived.iter().map(|page| page.key).collect::<Vec<_>>(), keys);
    }

    #[test]
    fn requested_pages_arrive_once_and_unwanted_ones_never() {
        let mut loader = loader();
        let keys = [0, 1].map(PageKey::root);
        loader.request(&keys, 0);
        loader.request(&keys[1..], 0);
        let mut arrived = Vec::new();
        while arrived.is_empty() {
            loader.collect(&mut arrived);
        }
        loader.collect(&mut arrived);
        assert_eq!(arrived.iter().map(|page| page.key).collect::<Vec<_>>(), keys[1..]);
    }

    #[test]
    fn what_failed_is_left_alone_for_twice_as_long_each_time_up_to_half_a_minute() {
        let mut loader = loader();
        let key = PageKey::root(0);
        let mut waits = Vec::new();
        for _ in 0..9 {
            loader.put(key, Err(SourceError::Panic { key, message: "no".into() }));
            waits.push(loader.failed[&key].wait_ns / WAIT_LEAST_NS);
            assert!(loader.rests(key));
        }
        assert_eq!(waits, [1, 2, 4, 8, 16, 32, 60, 60, 60]);
        let mut arrived = Vec::new();
        loader.fetch(&[key], &mut arrived);
        assert!(arrived.is_empty(), "it rests");
        assert_eq!(loader.faults().count(), 1);
        loader.failed.get_mut(&key).unwrap().again_ns = 0;
        loader.fetch(&[key], &mut arrived);
        assert_eq!((arrived.len(), loader.faults().count()), (1, 0));
    }

    /// A scene with imagery: these pictures, the topmost first, as files in a folder.
    fn draped(folder: &std::path::Path, pictures: &[(&str, Picture)]) -> SceneSettings {
        let mut scene = overfly_config::load("small").unwrap();
        for (name, picture) in pictures {
            let input = folder.join(name).with_extension("png");
            let output = folder.join(name).with_extension("pmtiles");
            picture.pixels.save(&input).unwrap();
            scene.imagery.push(output.display().to_string());
            let options = ImageryOptions {
                input,
                projection: None,
                bounds_deg: picture.bounds_deg,
                attribution: String::new(),
                output,
                body: ("small".into(), scene.body),
            };
            build_imagery(&options, &AtomicBool::new(false), &|_| {}).unwrap();
        }
        scene
    }

    struct Picture {
        pixels: image::RgbaImage,
        bounds_deg: Option<[f64; 4]>,
    }

    fn plain(size: [u32; 2], rgba: [u8; 4], bounds_deg: Option<[f64; 4]>) -> Picture {
        let pixels = image::RgbaImage::from_pixel(size[0], size[1], image::Rgba(rgba));
        Picture { pixels, bounds_deg }
    }

    fn sources(scene: &SceneSettings) -> Result<Sources, SourceError> {
        Sources::open(scene, &crate::archive::OpenOptions::default())
    }

    const RED: [u8; 4] = [250, 10, 10, 255];
    const BLUE: [u8; 4] = [10, 10, 250, 255];

    #[test]
    fn pages_down_to_the_imagery_come_with_its_colour_and_deeper_ones_without() {
        let folder = tempfile::tempdir().unwrap();
        let scene = draped(folder.path(), &[("world", plain([512, 256], RED, None))]);
        let bare = Sources::open(
            &overfly_config::load("small").unwrap(),
            &crate::archive::OpenOptions::default(),
        )
        .unwrap();
        let sources = Arc::new(sources(&scene).unwrap());
        assert_eq!(sources.contents(), [sources.imagery()[0].facts().content]);
        let depth = sources.imagery()[0].facts().depth;
        let keys: Vec<_> = (0..=depth + 1).map(|depth| PageKey::new(2, depth, 0, 0)).collect();
        let mut loader = Loader::new(sources, 1).unwrap();
        let mut arrived = Vec::new();
        loader.fetch(&keys, &mut arrived);
        assert_eq!((arrived.len(), loader.faults().count()), (keys.len(), 0));
        for page in &arrived {
            let plain = bare.page(page.key).unwrap();
            assert!(plain.colour.is_none());
            if page.key.depth() > depth {
                assert_eq!(**page, *plain, "nothing is different without colour");
                continue;
            }
            let colour = page.colour.as_ref().expect("the whole body is covered");
            assert_eq!(colour.key, page.key);
            assert!(colour.rgba.iter().all(|&texel| texel == RED));
            assert_ne!(page.content, plain.content);
            assert_eq!(page.bytes(), plain.bytes() + 66_596);
            assert_eq!(page.heights_m, plain.heights_m);
        }
    }

    #[test]
    fn finer_imagery_lies_over_coarser_which_shows_through_its_holes() {
        let folder = tempfile::tempdir().unwrap();
        let part = plain([180, 180], RED, Some([0.0, 0.0, 45.0, 45.0]));
        let world = plain([128, 64], BLUE, None);
        let scene = draped(folder.path(), &[("part", part), ("world", world)]);
        let sources = sources(&scene).unwrap();
        let [fine, coarse] = [0, 1].map(|index| sources.imagery()[index].facts().depth);
        assert!(fine > coarse, "{fine} {coarse}");
        let (mut red, mut blue) = (0, 0);
        // Along the equator, from within the part to beyond it.
        for x in 0..1 << fine {
            let key = PageKey::new(0, fine, x, (1 << fine) - 1 - x);
            let Some(colour) = sources.colour(key).unwrap() else { continue };
            for texel in &*colour.rgba {
                assert!([RED, BLUE].contains(texel), "{texel:?}");
                red += u32::from(*texel == RED);
                blue += u32::from(*texel == BLUE);
            }
        }
        assert!(red > 1000 && blue > 1000, "{red} {blue}");
        // Where only the coarse one has anything there is nothing deeper than it.
        assert!(sources.colour(PageKey::new(2, coarse, 0, 0)).unwrap().is_some());
        assert!(sources.colour(PageKey::new(2, coarse + 1, 0, 0)).unwrap().is_none());
    }

    #[test]
    fn where_imagery_is_damaged_the_ground_comes_without_and_the_fault_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let scene = draped(folder.path(), &[("world", plain([128, 64], RED, None))]);
        let path = folder.path().join("world.pmtiles");
        let mut bytes = std::fs::read(&path).unwrap();
        // Every picture's first chunk has another name, so that none can be read.
        let names: Vec<_> =
            (0..bytes.len() - 4).filter(|&at| &bytes[at..at + 4] == b"IHDR").collect();
        names.iter().for_each(|&at| bytes[at] = b'X');
        assert!(!names.is_empty());
        std::fs::write(&path, bytes).unwrap();
        let mut loader = Loader::new(Arc::new(sources(&scene).unwrap()), 1).unwrap();
        let key = PageKey::root(3);
        let mut arrived = Vec::new();
        loader.fetch(&[key], &mut arrived);
        assert_eq!(arrived.len(), 1);
        assert!(arrived[0].colour.is_none());
        let said: Vec<_> = loader.faults().map(|(key, error)| (key, error.to_string())).collect();
        assert_eq!((said.len(), said[0].0), (1, key));
        assert!(said[0].1.contains("world.pmtiles: it is damaged: tile 1/"), "{}", said[0].1);
        assert!(!loader.rests(key), "the page itself is sound");
    }

    #[test]
    fn archives_of_one_kind_do_not_serve_as_the_other() {
        let folder = tempfile::tempdir().unwrap();
        let mut scene = draped(folder.path(), &[("world", plain([128, 64], RED, None))]);
        let location = scene.imagery.remove(0);
        scene.sources.insert(0, SourceSettings::Archive { location });
        let error = sources(&scene).err().expect("it holds no heights").to_string();
        assert!(error.contains("world.pmtiles: it holds imagery"), "{error}");
        assert!(error.contains("elevation"), "{error}");
    }
}
