//! Whoever owns the threads, the results are the same and every run ends.
//!
//! In:    hosts that run tasks at once, late, in `finish`, on threads of theirs, or never; lent
//!        threads; frames.
//! Out:   assertions; the tests end.
//! Keeps: nothing.
//! Not here: workers with threads of their own (`wakes`).

use crate::{meet, workers};
use overfly_jobs::{Graph, Span, Task, WorkerOptions, Workers};
use std::iter;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Barrier, Mutex};
use std::thread;
use std::time::Duration;

type Cells = Vec<AtomicU64>;

/// A graph whose result depends on every edge and chunk.
fn graph() -> Graph<Cells> {
    let mut graph = Graph::new();
    let mut last = Vec::new();
    for stage in 0..6 {
        last = vec![graph.each(
            Span("mix"),
            &last,
            |_| 64,
            move |cells: &Cells, chunk, _| {
                let from = cells[stage % 2 * 64 + (chunk * 7 + 1) % 64].load(Ordering::Relaxed);
                let mixed =
                    (from ^ chunk as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(17);
                cells[(stage + 1) % 2 * 64 + chunk].store(mixed, Ordering::Relaxed);
            },
        )];
    }
    graph
}

fn result_of(workers: &Workers, frames: usize) -> Vec<u64> {
    let mut graph = graph();
    let cells: Cells = (0..128).map(AtomicU64::new).collect();
    for frame in 0..frames {
        let _frame = (frame % 2 == 0).then(|| workers.frame());
        graph.run(&cells, workers).unwrap();
        graph.run(&cells, workers).unwrap();
    }
    cells.into_iter().map(AtomicU64::into_inner).collect()
}

fn expected(frames: usize) -> Vec<u64> {
    result_of(&Workers::none(), frames)
}

#[test]
fn a_host_that_never_runs_a_task_gets_its_handles_back() {
    let finished = Arc::new(Mutex::new(Vec::new()));
    let (next, list) = (AtomicU64::new(0), Arc::clone(&finished));
    let enqueue = move |_task: Task| next.fetch_add(1, Ordering::Relaxed);
    let workers = Workers::host(3, enqueue, move |handle| list.lock().unwrap().push(handle));
    let workers = workers.unwrap();
    assert_eq!(workers.count(), 3);
    assert_eq!(result_of(&workers, 10), expected(10));
    // Even frames are held open over two runs; in odd ones each run is a frame.
    assert_eq!(*finished.lock().unwrap(), (0..3 * 15).collect::<Vec<_>>());
}

#[test]
fn a_host_may_run_tasks_inside_enqueue() {
    let enqueue = |task: Task| {
        task.run();
        0
    };
    let workers = Workers::host(2, enqueue, |_| ()).unwrap();
    assert_eq!(result_of(&workers, 20), expected(20));
}

#[test]
fn a_host_may_run_tasks_late_even_after_the_workers_are_gone() {
    let kept = Arc::new(Mutex::new(Vec::new()));
    let (list, late) = (Arc::clone(&kept), Arc::clone(&kept));
    let enqueue = move |task: Task| {
        list.lock().unwrap().push(task);
        0
    };
    // The first half is run when its frame is over, the rest when everything is.
    let finish = move |_| {
        let mut late = late.lock().unwrap();
        let half = late.len() / 2;
        late.drain(..half).for_each(Task::run);
    };
    let workers = Workers::host(4, enqueue, finish).unwrap();
    assert_eq!(result_of(&workers, 20), expected(20));
    drop(workers);
    let rest = std::mem::take(&mut *kept.lock().unwrap());
    assert!(!rest.is_empty());
    rest.into_iter().for_each(Task::run);
}

/// The life of a host's thread: until there will be no more tasks.
fn run_all(tasks: &Mutex<Receiver<Task>>) {
    let next = || tasks.lock().unwrap().recv().ok();
    iter::from_fn(next).for_each(Task::run);
}

#[test]
fn a_host_with_threads_helps_and_its_tasks_end_with_the_frame() {
    let (sender, tasks) = channel::<Task>();
    let tasks = Arc::new(Mutex::new(tasks));
    let pool: Vec<_> = (0..2)
        .map(|_| {
            let tasks = Arc::clone(&tasks);
            thread::spawn(move || run_all(&tasks))
        })
        .collect();
    let enqueue = move |task: Task| {
        sender.send(task).unwrap();
        0
    };
    let workers = Workers::host(2, enqueue, |_| ()).unwrap();
    assert_eq!(result_of(&workers, 300), expected(300));
    // All three must be there at once, or this would hang.
    meet(&workers, 3);
    drop(workers);
    pool.into_iter().for_each(|thread| thread.join().unwrap());
}

fn lend_until(stop: &AtomicBool, workers: &Workers) {
    while !stop.load(Ordering::Relaxed) {
        if !workers.join_as_worker() {
            thread::yield_now();
        }
    }
}

#[test]
fn lent_threads_work_until_the_frame_closes() {
    let workers = Workers::with(WorkerOptions { seats: 2, ..WorkerOptions::default() }).unwrap();
    assert!(!workers.join_as_worker(), "no frame is open");
    let stop = AtomicBool::new(false);
    thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| lend_until(&stop, &workers));
        }
        assert_eq!(result_of(&workers, 300), expected(300));
        meet(&workers, 3);
        stop.store(true, Ordering::Relaxed);
    });
}

#[test]
fn a_thread_in_a_frame_is_not_lent_to_itself() {
    let workers = Workers::with(WorkerOptions { seats: 1, ..WorkerOptions::default() }).unwrap();
    let _frame = workers.frame();
    assert!(!workers.join_as_worker());
    let mut graph = Graph::<Workers>::new();
    graph.stage(Span("self"), &[], |workers, _| assert!(!workers.join_as_worker()));
    graph.run(&workers, &workers).unwrap();
}

#[test]
fn frames_may_nest_overlap_and_be_empty() {
    for count in [0, 1, 3] {
        let workers = workers(count);
        for _ in 0..200 {
            let outer = workers.frame();
            let inner = workers.frame();
            drop(outer);
            assert_eq!(result_of(&workers, 1), expected(1));
            drop(inner);
            drop(workers.frame());
        }
    }
}

#[test]
fn sixty_four_workers_on_few_cores_give_the_same_result() {
    for options in [
        WorkerOptions { count: 64, ..WorkerOptions::default() },
        WorkerOptions { count: 64, spin_us: 0, ..WorkerOptions::default() },
        WorkerOptions { count: 9, spin_us: 5000, pin_to_cores: vec![0; 9], ..Default::default() },
    ] {
        assert_eq!(result_of(&Workers::with(options).unwrap(), 40), expected(40));
    }
}

#[test]
fn a_core_that_does_not_exist_is_refused_where_threads_can_be_pinned() {
    let options = WorkerOptions { count: 2, pin_to_cores: vec![1023], ..WorkerOptions::default() };
    let refusal = Workers::with(options).err();
    if cfg!(target_os = "linux") {
        let text = refusal.unwrap().to_string();
        assert_eq!(text, "a worker thread could not be bound to its core");
    } else {
        assert!(refusal.is_none());
    }
}

#[test]
fn threads_are_named_as_asked() {
    let name = "terrain".to_owned();
    let options = WorkerOptions { count: 1, name, ..WorkerOptions::default() };
    let workers = Workers::with(options).unwrap();
    let names = Mutex::new(Vec::new());
    let mut graph = Graph::<(Barrier, &Mutex<Vec<String>>)>::new();
    for span in [Span("one"), Span("two")] {
        graph.stage(span, &[], |(barrier, names), _| {
            let name = thread::current().name().unwrap_or_default().to_owned();
            names.lock().unwrap().push(name);
            barrier.wait();
        });
    }
    graph.run(&(Barrier::new(2), &names), &workers).unwrap();
    assert!(names.lock().unwrap().contains(&"terrain-1".to_owned()));
}

#[test]
fn an_open_frame_costs_nothing_after_the_spin() {
    // Long enough that all sleep inside the frame; the run must wake them again.
    let workers = workers(2);
    let frame = workers.frame();
    thread::sleep(Duration::from_millis(3));
    meet(&workers, 3);
    drop(frame);
}
