//! One size class of craters: at most one in each cell of a cubic lattice.
//!
//! In:    a point in metres, its normal, and noise that dents the rims.
//! Out:   height and brightness of the craters around the point.
//! Keeps: the class's cell size, density and depth.
//! Not here: how classes add up and where maria thin them out (`cratered`).

use glam::DVec3;

use super::noise::{ROUND, mix, ramp, unit};

/// Craters of one size class.
pub(super) struct Craters {
    pub cell_m: f64,
    per_m: f64,
    seed: u64,
    /// Share of the cells that hold a crater.
    density: f64,
    /// Depth of the freshest crater in rim radii.
    depth: f64,
    /// Height of a central peak in depths; 0 in bowls.
    peak: f64,
}

/// What the craters of one class do at one point.
#[derive(Clone, Copy, Default)]
pub(super) struct Dent {
    pub height_m: f64,
    /// 0 on old ground, above 0 on fresh ejecta.
    pub fresh: f64,
}

/// Farthest a crater reaches, in cells; centres keep `MARGIN` from the walls, so that the eight
/// cells around a point hold all that reach it.
const REACH: f64 = 0.65;
const MARGIN: f64 = 0.15;
/// Squared reach of the ejecta in rim radii.
const EJECTA: f64 = 4.0;

impl Craters {
    /// Highest and lowest a class stands where its craters overlap, in depths of its deepest; what
    /// would go farther (rare) is cut.
    pub(super) const RIM_SHARE: f64 = 0.4;
    pub(super) const PIT_SHARE: f64 = 1.1;

    pub(super) fn new(cell_m: f64, seed: u64) -> Craters {
        // Craters wider than some 20 km collapse: shallower, with a flat floor and a peak.
        let complex = ramp(5.0e3, 6.0e4, cell_m);
        Craters {
            cell_m,
            per_m: 1.0 / cell_m,
            seed,
            density: 0.55 - 0.25 * complex,
            depth: 0.34 - 0.24 * complex - 0.08 * ramp(5.0e4, 3.0e5, cell_m),
            peak: 0.5 * ramp(3.0e4, 8.0e4, cell_m) * (1.0 - ramp(2.0e5, 5.0e5, cell_m)),
        }
    }

    /// Depth of the deepest crater of the class in metres.
    pub(super) fn deepest_m(&self) -> f64 {
        self.depth * REACH / EJECTA.sqrt() * self.cell_m
    }

    /// The dents around a point; `wobble` (-1..1) pushes rims out of round.
    pub(super) fn at(&self, at_m: DVec3, n: DVec3, wobble: f64) -> Dent {
        let p = at_m * self.per_m;
        let corner = p - DVec3::ONE;
        let (bx, by, bz) = (corner.x + ROUND, corner.y + ROUND, corner.z + ROUND);
        let base = DVec3::new(bx - ROUND, by - ROUND, bz - ROUND);
        let base_bits = [bx.to_bits(), by.to_bits(), bz.to_bits()];
        let mut dent = Dent::default();
        for i in 0..8u64 {
            let step = [i & 1, (i >> 1) & 1, i >> 2];
            let hash = self.hash(base_bits, step);
            if unit(hash) >= self.density {
                continue;
            }
            let [x, y, z] = step.map(|s| if s == 1 { 1.0 } else { 0.0 });
            let cell = base + DVec3::new(x, y, z);
            self.add(cell + centre(hash) - p, n, (hash, wobble), &mut dent);
        }
        let deepest_m = self.deepest_m();
        dent.height_m =
            dent.height_m.clamp(-Self::PIT_SHARE * deepest_m, Self::RIM_SHARE * deepest_m);
        dent
    }

    fn hash(&self, base: [u64; 3], step: [u64; 3]) -> u64 {
        let [x, y, z] = [0, 1, 2].map(|i| base[i].wrapping_add(step[i]));
        let sum = x
            .wrapping_mul(0x9E37_79B9_7F4A_7C15)
            .wrapping_add(y.wrapping_mul(0xC2B2_AE3D_27D4_EB4F))
            .wrapping_add(z.wrapping_mul(0x1656_67B1_9E37_79F9));
        mix(sum.wrapping_add(self.seed))
    }

    /// Adds one crater, `offset` cells away; its circle is where a ball of `REACH` cuts the ground.
    fn add(&self, offset: DVec3, n: DVec3, (hash, wobble): (u64, f64), dent: &mut Dent) {
        let above = n.dot(offset);
        let far2 = offset.length_squared() - above * above;
        let cut2 = REACH * REACH - above * above;
        if far2 >= cut2 {
            return;
        }
        let traits = mix(hash ^ 0xA076_1D64_78BD_642F);
        // Balls that barely touch the ground would leave sharp little pits; they fade instead.
        let touch = ramp(0.35, 0.75, cut2 / (REACH * REACH));
        let size = 0.45 + 0.55 * unit(traits);
        let q = EJECTA * far2 / (cut2 * size * size) * (1.0 + 0.22 * wobble);
        if q >= EJECTA {
            return;
        }
        let age = unit(traits.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let fresh = 1.0 - 0.88 * age;
        let rim_radius_m = (cut2 / EJECTA).sqrt() * size * self.cell_m;
        let depth_m = self.depth * rim_radius_m * touch;
        dent.height_m += depth_m * fresh * self.profile(q, fresh);
        let window = 1.0 - q / EJECTA;
        dent.fresh += ramp(0.88, 1.0, fresh) * touch * window * window;
    }

    /// Height in depths at `q` squared rim radii from the centre; 0 with 0 slope from `EJECTA`.
    fn profile(&self, q: f64, fresh: f64) -> f64 {
        const RIM: f64 = 0.28;
        let outside = 1.0 - q / EJECTA;
        let outer = RIM * 2.0 * outside * outside * outside;
        let bowl = -1.0 + (1.0 + RIM) * q;
        // Old rims are rounder.
        let soft = 0.55 - 0.40 * fresh;
        let apart = bowl - outer;
        let shape = 0.5 * (bowl + outer - (apart * apart + soft * soft).sqrt());
        let near = 1.0 - q * 12.0;
        let peak = if near > 0.0 { self.peak * near * near } else { 0.0 };
        let window = 1.0 - (q / EJECTA) * (q / EJECTA);
        let floor = -0.85 - 0.1 * self.peak;
        let lift = shape - floor;
        let shape = 0.5 * (shape + floor + (lift * lift + 0.01).sqrt());
        (shape + peak) * window * window
    }
}

/// A crater's centre in its cell.
fn centre(hash: u64) -> DVec3 {
    let spread = 1.0 - 2.0 * MARGIN;
    let part = |shift: u32| {
        let bits = (hash >> shift) & 0xFFFF;
        f64::from_bits((bits << 36) | 0x3FF0_0000_0000_0000) - 1.0
    };
    DVec3::new(part(0), part(16), part(32)) * spread + DVec3::splat(MARGIN)
}
