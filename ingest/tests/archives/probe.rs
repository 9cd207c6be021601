use crate::rasters::*; use overfly_ingest::raster::*; 
#[test] fn probe_damage(){ let folder = tempfile::tempdir().unwrap();
 let sheet = Sheet::new([10.0, 46.25], 0.0025, [101, 101]);
 let p=sheet.write_whole(&folder.path().join("small.tif"), rugged_m);
 let mut b=std::fs::read(&p).unwrap(); let r=open(&p,&OpenOptions::default()).unwrap().pop().unwrap(); let mut a=vec![]; r.window(0,0,101,101,&mut a).unwrap();
 for at in (200..b.len()-600).step_by(997) { let old=b.clone(); b[at..at+64].fill(0xA5); let q=folder.path().join("q.tif"); std::fs::write(&q,&b).unwrap(); b=old;
  let r=open(&q,&OpenOptions::default()).unwrap().pop().unwrap(); let mut c=vec![]; let e=r.window(0,0,101,101,&mut c); eprintln!("{at}/{} {:?} differing {}",b.len(),e.map_err(|e|e.to_string()),a.iter().zip(&c).filter(|(x,y)|x!=y).count()); } }
