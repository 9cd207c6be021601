//! Stand-in.
use glam::DVec3;
/// Settings.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ProceduralSettings { 
    /// s
    pub seed: u64, 
    /// r
    pub radius_m: f64,
    /// s
    pub style: Style, 
    /// r
    pub relief: f64, 
    /// f
    pub finest_m: f64 }
/// Style.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Style { 
    /// Earth-like
    Earthlike, 
    /// Moon
    Cratered }
/// Planet.
pub struct Planet { radius_m: f64 }
/// Sample.
#[derive(Clone, Copy)] pub struct Sample { 
    /// h
    pub height_m: f64, 
    /// l
    pub layers: Layers, 
    /// r
    pub ruggedness: f64 }
/// Layers.
#[derive(Clone, Copy, PartialEq, Eq, Default)] pub struct Layers { 
    /// r
    pub roughness: u8,
    /// r
    pub rock: u8, 
    /// m
    pub moisture: u8, 
    /// t
    pub temperature: u8 }
impl Planet {
    /// New.
    pub fn new(settings: &ProceduralSettings) -> Planet { Planet { radius_m: settings.radius_m } }
    /// Sample.
    pub fn sample(&self, n: DVec3) -> Sample { let s = 400.0; let p = n * self.radius_m / 20_000.0; let w = |x: f64| { let t = x - x.floor(); let t = if t < 0.5 { t } else { 1.0 - t }; t * t * 8.0 - 1.0 }; Sample { height_m: s * (w(p.x) + w(p.y) + w(p.z)), layers: Layers::default(), ruggedness: 1.0 } }
    /// Range.
    pub fn height_range_m(&self) -> [f64; 2] { [-1300.0, 1300.0] }
    /// Residual.
    pub fn residual_m(&self, edge_m: f64, r: f64) -> f64 { let e = edge_m / 20_000.0; 1200.0 * (2.0 * e * e).min(2.0) * r }
    /// Variation.
    pub fn variation_m(&self, d: f64, r: f64) -> f64 { (1200.0 * 4.0 * d / 20_000.0).min(2600.0) * r }
    /// Slope.
    pub fn ruggedness_slope_per_m(&self) -> f64 { 0.0 }
}
