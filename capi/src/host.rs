//! What a host brings to a terrain, as C gives it: threads, how pages come, functions of its own.
//!
//! In:    [`ovf_host`].
//! Out:   `overfly::Host`, and the tasks that the host's scheduler will run.
//! Keeps: nothing.
//! Not here: calling the host's functions (`callbacks`).

use crate::border::Caller;
use crate::callbacks::User;
use crate::status::Fault;
use crate::tasks::Tasks;
use bytemuck::Zeroable;
use overfly::archive::{OpenOptions, Reader};
use overfly::{Host, HostThreads, Pages, Workers};
use std::ffi::{c_char, c_void};
use std::sync::Arc;
use std::time::Duration;

/// `ovf_host.workers`: nobody helps the thread that runs a frame; no thread is started.
pub const OVF_WORKERS_CALLER: u32 = 0;
/// `ovf_host.workers`: `worker_count` threads of overfly's, which sleep between frames.
pub const OVF_WORKERS_OWN: u32 = 1;
/// `ovf_host.workers`: at most `worker_count` threads of the host that are in `ovf_terrain_work`.
pub const OVF_WORKERS_LENT: u32 = 2;
/// `ovf_host.workers`: `spawn` is called with `worker_count` tasks a frame.
pub const OVF_WORKERS_SPAWNED: u32 = 3;

/// `ovf_host.pages`: threads of overfly's make what a frame lacks; it comes when it is ready.
pub const OVF_PAGES_AS_READY: u32 = 0;
/// `ovf_host.pages`: as that, but the next frame waits for it: the same frames on every machine.
pub const OVF_PAGES_WAITED: u32 = 1;
/// `ovf_host.pages`: threads of the host call `ovf_terrain_load_page` for what
/// `ovf_terrain_wanted` lists.
pub const OVF_PAGES_HOST: u32 = 2;

/// What a host brings. All zeros but `struct_size`: no helpers, one thread that makes pages as they
/// are wanted, files and servers read by overfly.
///
/// The functions may be called from any thread until `ovf_terrain_destroy` returns; they must not
/// throw, jump out or call `ovf_terrain_destroy`.
#[repr(C)]
#[derive(Clone, Copy, Zeroable)]
pub struct ovf_host {
    /// `sizeof(ovf_host)`.
    pub struct_size: u32,
    /// `OVF_WORKERS_…`.
    pub workers: u32,
    /// Threads, seats or tasks, 0 to 64.
    pub worker_count: u32,
    /// `OVF_PAGES_…`.
    pub pages: u32,
    /// Threads of overfly's that make pages, 0 to 64; 0 is 1.
    pub loader_threads: u32,
    /// Longest wait for a server's connection in milliseconds; 0 is 5000.
    pub connect_timeout_ms: u32,
    /// Longest wait for a server's next bytes in milliseconds; 0 is 10000.
    pub read_timeout_ms: u32,
    /// 0.
    pub reserved: u32,
    /// Goes back to the functions, and is never looked into.
    pub user: *mut c_void,
    /// A frame has begun: some thread shall call `ovf_terrain_run_task` with `task`, at once, later
    /// or never. What it returns goes to `finish`. Needed with `OVF_WORKERS_SPAWNED`.
    pub spawn: Option<unsafe extern "C" fn(user: *mut c_void, task: u64) -> u64>,
    /// The frame is over; tasks that still wait have nothing to do any more. May be null.
    pub finish: Option<unsafe extern "C" fn(user: *mut c_void, spawned: u64)>,
    /// Reads archives instead of overfly, whatever their locations look like: puts up to
    /// `length_bytes` bytes from `offset_bytes` on into `buffer` and returns how many, fewer only
    /// at the archive's end, or a negative number where it fails. Called from threads that make
    /// pages and from `ovf_terrain_new_v1`, several at once; may block. May be null.
    pub read: Option<
        unsafe extern "C" fn(
            user: *mut c_void,
            location: *const c_char,
            offset_bytes: u64,
            length_bytes: u64,
            buffer: *mut u8,
        ) -> i64,
    >,
}

/// Most threads of one kind.
const THREADS_MAX: u32 = 64;

/// What the host brings; nothing where C gave null.
pub fn brought(caller: &Caller, host: *const ovf_host) -> Result<(Host, Arc<Tasks>), Fault> {
    let tasks = Arc::new(Tasks::new());
    let host = if host.is_null() { ovf_host::zeroed() } else { caller.sized("host", host)? };
    for (name, count) in
        [("worker_count", host.worker_count), ("loader_threads", host.loader_threads)]
    {
        if count > THREADS_MAX {
            let sentence = format!("host: {name} is {count}, allowed is 0 to {THREADS_MAX}");
            return Err(Fault::invalid(sentence));
        }
    }
    let all =
        Host { workers: workers(&host, &tasks)?, pages: pages(&host)?, patience: patience(&host) };
    Ok((all, tasks))
}

fn workers(host: &ovf_host, tasks: &Arc<Tasks>) -> Result<Workers, Fault> {
    let (count, user) = (host.worker_count as usize, User(host.user));
    match host.workers {
        OVF_WORKERS_CALLER => Ok(Workers::Caller),
        OVF_WORKERS_OWN => Ok(Workers::Own(count)),
        OVF_WORKERS_LENT => Ok(Workers::Host(HostThreads::Lent { most: count })),
        OVF_WORKERS_SPAWNED => {
            let Some(spawn) = host.spawn else {
                return Err(Fault::invalid("host: spawn is null, but workers are to be spawned"));
            };
            let finish: Box<dyn Fn(u64) + Send + Sync> = match host.finish {
                Some(finish) => Box::new(user.finisher(finish)),
                None => Box::new(|_| {}),
            };
            let enqueue = Box::new(user.spawner(spawn, tasks.clone()));
            Ok(Workers::Host(HostThreads::Spawned { tasks: count, enqueue, finish }))
        }
        workers => {
            let most = OVF_WORKERS_SPAWNED;
            Err(Fault::invalid(format!("host: workers is {workers}, allowed is 0 to {most}")))
        }
    }
}

fn pages(host: &ovf_host) -> Result<Pages, Fault> {
    let threads = host.loader_threads.max(1) as usize;
    match host.pages {
        OVF_PAGES_AS_READY => Ok(Pages::AsReady { threads }),
        OVF_PAGES_WAITED => Ok(Pages::Waited { threads }),
        OVF_PAGES_HOST => Ok(Pages::Host),
        pages => {
            Err(Fault::invalid(format!("host: pages is {pages}, allowed is 0 to {OVF_PAGES_HOST}")))
        }
    }
}

fn patience(host: &ovf_host) -> OpenOptions {
    let usual = OpenOptions::default();
    let or = |ms: u32, usual: Duration| {
        if ms == 0 { usual } else { Duration::from_millis(u64::from(ms)) }
    };
    OpenOptions {
        connect_timeout: or(host.connect_timeout_ms, usual.connect_timeout),
        read_timeout: or(host.read_timeout_ms, usual.read_timeout),
        reader: host.read.map(|read| Reader::new(User(host.user).reader(read))),
        ..usual
    }
}
