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

/// The cells around a point.
#[derive(Clone, Copy)]
pub(super) struct Nook {
    /// The point, in cells.
    p: DVec3,
    /// The first corner, and the sum of its coordinates' hashes and the seed.
    base: DVec3,
    sum: u64,
}

/// The ball of a crater, in squared cells: how far its axis is from the point, and the radius of
/// the circle in which it cuts the ground.
#[derive(Clone, Copy)]
pub(super) struct Ball {
    pub far2: f64,
    pub cut2: f64,
}

/// Cells around a point.
pub(super) const CORNERS: usize = 8;
const PRIMES: [u64; 3] = [0x9E37_79B9_7F4A_7C15, 0xC2B2_AE3D_27D4_EB4F, 0x1656_67B1_9E37_79F9];
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
    #[inline(always)]
    pub(super) fn deepest_m(&self) -> f64 {
        self.depth * REACH / EJECTA.sqrt() * self.cell_m
    }

    /// The dents around a point; `wobble` (-1..1) pushes rims out of round.
    pub(super) fn at(&self, at_m: DVec3, n: DVec3, wobble: f64) -> Dent {
        let nook = self.nook(at_m);
        let mut dent = Dent::default();
        for corner in 0..CORNERS {
            let hash = self.hash(&nook, corner);
            if !self.is_hit(hash) {
                continue;
            }
            let ball = ball(&nook, corner, hash, n);
            if ball.reaches() {
                dent.add(&self.crater(hash, &ball, wobble));
            }
        }
        self.cut(dent)
    }

    /// The eight cells around a point.
    #[inline(always)]
    pub(super) fn nook(&self, at_m: DVec3) -> Nook {
        let p = at_m * self.per_m;
        let corner = p - DVec3::ONE;
        let (bx, by, bz) = (corner.x + ROUND, corner.y + ROUND, corner.z + ROUND);
        let base = DVec3::new(bx - ROUND, by - ROUND, bz - ROUND);
        let sum = bx
            .to_bits()
            .wrapping_mul(PRIMES[0])
            .wrapping_add(by.to_bits().wrapping_mul(PRIMES[1]))
            .wrapping_add(bz.to_bits().wrapping_mul(PRIMES[2]))
            .wrapping_add(self.seed);
        Nook { p, base, sum }
    }

    /// The random bits of one of the cells.
    #[inline(always)]
    pub(super) fn hash(&self, nook: &Nook, corner: usize) -> u64 {
        let step = |axis: usize| if corner >> axis & 1 == 1 { PRIMES[axis] } else { 0 };
        let sum = nook.sum.wrapping_add(step(0)).wrapping_add(step(1)).wrapping_add(step(2));
        mix(sum)
    }

    /// Whether a cell holds a crater.
    #[inline(always)]
    pub(super) fn is_hit(&self, hash: u64) -> bool {
        unit(hash) < self.density
    }

    /// One crater that reaches the point; its circle is where a ball of [`REACH`] cuts the ground.
    #[inline(always)]
    pub(super) fn crater(&self, hash: u64, ball: &Ball, wobble: f64) -> Dent {
        let &Ball { far2, cut2 } = ball;
        let traits = mix(hash ^ 0xA076_1D64_78BD_642F);
        // Balls that barely touch the ground would leave sharp little pits; they fade instead.
        let touch = ramp(0.35, 0.75, cut2 / (REACH * REACH));
        let size = 0.45 + 0.55 * unit(traits);
        let q = EJECTA * far2 / (cut2 * size * size) * (1.0 + 0.22 * wobble);
        if q >= EJECTA {
            return Dent::default();
        }
        let age = unit(traits.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let fresh = 1.0 - 0.88 * age;
        let rim_radius_m = (cut2 / EJECTA).sqrt() * size * self.cell_m;
        let depth_m = self.depth * rim_radius_m * touch;
        let window = 1.0 - q / EJECTA;
        Dent {
            height_m: depth_m * fresh * self.profile(q, fresh),
            fresh: ramp(0.88, 1.0, fresh) * touch * window * window,
        }
    }

    /// What all craters of the class together may do.
    #[inline(always)]
    pub(super) fn cut(&self, dent: Dent) -> Dent {
        let deepest_m = self.deepest_m();
        let height_m =
            dent.height_m.clamp(-Self::PIT_SHARE * deepest_m, Self::RIM_SHARE * deepest_m);
        Dent { height_m, ..dent }
    }

    /// Height in depths at `q` squared rim radii from the centre; 0 with 0 slope from `EJECTA`.
    #[inline(always)]
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

impl Dent {
    #[inline(always)]
    pub(super) fn add(&mut self, crater: &Dent) {
        self.height_m += crater.height_m;
        self.fresh += crater.fresh;
    }
}

impl Ball {
    #[inline(always)]
    pub(super) fn reaches(&self) -> bool {
        self.far2 < self.cut2
    }
}

/// How the ball of a crater in one of the cells lies to a point.
#[inline(always)]
pub(super) fn ball(nook: &Nook, corner: usize, hash: u64, n: DVec3) -> Ball {
    let step = |axis: usize| if corner >> axis & 1 == 1 { 1.0 } else { 0.0 };
    let offset = nook.base + DVec3::new(step(0), step(1), step(2)) + centre(hash) - nook.p;
    let above = n.dot(offset);
    let far2 = offset.length_squared() - above * above;
    Ball { far2, cut2: REACH * REACH - above * above }
}

/// A crater's centre in its cell.
#[inline(always)]
fn centre(hash: u64) -> DVec3 {
    let spread = 1.0 - 2.0 * MARGIN;
    let part = |shift: u32| {
        let bits = (hash >> shift) & 0xFFFF;
        f64::from_bits((bits << 36) | 0x3FF0_0000_0000_0000) - 1.0
    };
    DVec3::new(part(0), part(16), part(32)) * spread + DVec3::splat(MARGIN)
}
