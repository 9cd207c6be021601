//! Loader threads: turn wanted page keys into pages, beside the frame.
//!
//! In:    keys from `FrameOutput::wanted`, or from a recording.
//! Out:   pages for `FrameInput::arrived`.
//! Keeps: threads, what is in flight.
//! Not here: which pages are wanted (`overfly_core::lod`), making one (`Generator`).

use crossbeam::channel::{Receiver, Sender, unbounded};
use overfly_core::datasource::generate::Generator;
use overfly_core::datasource::{Page, PageKey};
use overfly_jobs::now_ns;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::thread::JoinHandle;

/// The threads, and what is in flight.
pub struct Loader {
    jobs: Option<Sender<PageKey>>,
    done: Receiver<Arc<Page>>,
    threads: Vec<JoinHandle<()>>,
    in_flight: BTreeSet<PageKey>,
    /// Pages that are ready and wait for their time or their turn.
    ready: BTreeMap<PageKey, Arc<Page>>,
    /// Live arrivals: keys in the order asked for, with the time before which they stay away.
    due: Vec<(PageKey, u64)>,
}

impl Loader {
    /// Starts `threads` loader threads, at least one.
    ///
    /// # Errors
    /// If the system refuses a thread.
    pub fn new(generator: Arc<Generator>, threads: usize) -> std::io::Result<Self> {
        let (jobs, todo) = unbounded::<PageKey>();
        let (finished, done) = unbounded();
        let start = |index| {
            let (todo, finished, generator) = (todo.clone(), finished.clone(), generator.clone());
            let name = format!("loader {index}");
            std::thread::Builder::new()
                .name(name)
                .spawn(move || serve(&todo, &finished, &generator))
        };
        let threads = (0..threads.max(1)).map(start).collect::<Result<_, _>>()?;
        Ok(Self {
            jobs: Some(jobs),
            done,
            threads,
            in_flight: BTreeSet::new(),
            ready: BTreeMap::new(),
            due: Vec::new(),
        })
    }

    /// Waits for exactly these pages and appends them in this order.
    pub fn fetch(&mut self, keys: &[PageKey], arrived: &mut Vec<Arc<Page>>) {
        keys.iter().for_each(|&key| self.ask(key));
        for &key in keys {
            while !self.ready.contains_key(&key) {
                let page = self.done.recv().expect("loader threads live as long as the loader");
                self.put(page);
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

    /// Appends what was requested, is ready and due, in the order of the requests.
    pub fn collect(&mut self, arrived: &mut Vec<Arc<Page>>) {
        while let Ok(page) = self.done.try_recv() {
            self.put(page);
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

    fn ask(&mut self, key: PageKey) {
        if !self.ready.contains_key(&key) && self.in_flight.insert(key) {
            let jobs = self.jobs.as_ref().expect("open until dropped");
            jobs.send(key).expect("loader threads live as long as the loader");
        }
    }

    fn put(&mut self, page: Arc<Page>) {
        self.in_flight.remove(&page.key);
        self.ready.insert(page.key, page);
    }
}

/// Makes pages until there is nobody left to ask or to answer.
fn serve(todo: &Receiver<PageKey>, finished: &Sender<Arc<Page>>, generator: &Generator) {
    for key in todo {
        if finished.send(generator.page(key)).is_err() {
            break;
        }
    }
}

impl Drop for Loader {
    fn drop(&mut self) {
        self.jobs = None;
        for thread in self.threads.drain(..) {
            // A loader thread that panicked has said so; there is nobody left to tell.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn loader() -> Loader {
        let scene = overfly_config::load("small").unwrap();
        Loader::new(Arc::new(Generator::new(&scene)), 2).unwrap()
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
}
