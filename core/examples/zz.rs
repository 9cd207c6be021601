//! x
#![allow(missing_docs)]
#[path = "../leb/mod.rs"]
mod leb;
use leb::engine::Engine;
use leb::workload::*;
use overfly_jobs::now_ns;
fn main(){
    for p in [Preset::L50k, Preset::L200k, Preset::L1M] { for sp in [Speed::V1, Speed::V10] {
    let mut e = Engine::new(p);
    let f = Flight{path:Path::Cruise,speed:sp};
    e.frame(f.eye(0));
    let mut a = vec![]; let mut b = vec![]; let mut ev = (0,0,0);
    for i in 1..400 { let t0 = now_ns(); let pri = e.first_half(f.eye(i)); let t1 = now_ns(); let d = e.second_half(); let t2 = now_ns(); a.push(t1-t0); b.push(t2-t1); ev.0 += pri; ev.1 += d.evaluations - pri; ev.2 += d.splits + d.merges; }
    a.sort(); b.sort();
    println!("{} {} prioritise {} us ({} ns/eval), refine {} us ({} ns/op) evals {} {} ops {}", p.name(), sp.name(), a[200]/1000, a[200]*399/ev.0 as u64, b[200]/1000, b[200]*399/ev.2 as u64, ev.0/399, ev.1/399, ev.2/399);
    }}
}
