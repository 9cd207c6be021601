//! x
#![allow(missing_docs)]
#[path = "../leb/mod.rs"]
mod leb;
use leb::engine::Engine;
use leb::workload::*;
fn main(){
    let mut e = Engine::new(Preset::L1M);
    let f = Flight{path:Path::Cruise,speed:Speed::V10};
    e.frame(f.eye(0));
    for _ in 0..1 { for i in 0..1200 { e.first_half(f.eye(i)); e.second_half(); } }
}
