//! Simplex gradient noise and slope-following stripes in three dimensions, without a period.
//!
//! In:    points in metres (any f64 below 1e15 wavelengths from the origin).
//! Out:   values within [`PEAK`], with gradients per metre where asked for.
//! Keeps: nothing; a [`Lattice`] is its orientation, offset and seed.
//! Not here: which octaves a planet has and what they add up to (`earthlike`, `cratered`).
//! Source: K. Perlin, Noise hardware (2001); integer hashes instead of a permutation table.

use glam::DVec3;

use crate::geodesy::frames::narrow;

/// 1.5 * 2^52: adding and subtracting it rounds to an integer without a call, and the sum's bits
/// count up by one per integer, so they serve as lattice coordinates.
pub(super) const ROUND: f64 = 6_755_399_441_055_744.0;
const PRIME_X: u64 = 0x9E37_79B9_7F4A_7C15;
const PRIME_Y: u64 = 0xC2B2_AE3D_27D4_EB4F;
const PRIME_Z: u64 = 0x1656_67B1_9E37_79F9;
/// No value of [`Lattice::value`] is farther from 0. One corner alone reaches 0.694; where it does,
/// the other three are so far away that they add less than 0.02, and midway all four give less.
pub(super) const PEAK: f64 = 0.75;
const SCALE: f64 = 75.5;
const SIXTH: f64 = 1.0 / 6.0;
const SIXTH32: f32 = 1.0 / 6.0;
const THIRD: f64 = 2.0 * SIXTH;
const THIRD32: f32 = 2.0 * SIXTH32;

/// Half of the gradients; their covariance is a third of the identity, so no axis is favoured.
const HALF_GRADIENTS: [[f64; 3]; 16] = [
    [-0.789899888, -0.555841034, 0.259034577],
    [-0.776049191, -0.445946436, -0.445958999],
    [0.157993327, 0.699823835, 0.696623793],
    [-0.453482995, 0.786932781, -0.418437535],
    [-0.424130738, -0.150894050, -0.892941265],
    [-0.210145137, 0.966627041, 0.146530495],
    [0.426392658, 0.892432989, 0.147487837],
    [-0.787414576, 0.258494239, -0.559606123],
    [-0.457163807, -0.412871262, 0.787742709],
    [-0.212636464, 0.152295266, 0.965190078],
    [0.809821617, -0.080704588, -0.581098716],
    [0.808283180, -0.583979377, -0.075142450],
    [0.180402953, 0.877632085, -0.444090867],
    [-0.999546061, -0.019790276, -0.022716012],
    [-0.473882388, 0.625041447, 0.620289184],
    [0.176358518, -0.439986681, 0.880516549],
];

static GRADIENTS: [[f64; 4]; 32] = with_opposites(&HALF_GRADIENTS);
static GRADIENTS_F32: [[f32; 4]; 32] = narrowed(&GRADIENTS);

const fn with_opposites(half: &[[f64; 3]; 16]) -> [[f64; 4]; 32] {
    let mut all = [[0.0; 4]; 32];
    let mut i = 0;
    while i < 16 {
        let [x, y, z] = half[i];
        all[i] = [x, y, z, 0.0];
        all[i + 16] = [-x, -y, -z, 0.0];
        i += 1;
    }
    all
}

const fn narrowed(wide: &[[f64; 4]; 32]) -> [[f32; 4]; 32] {
    let mut all = [[0.0; 4]; 32];
    let mut i = 0;
    while i < 32 {
        let [x, y, z, _] = wide[i];
        all[i] = [narrow(x), narrow(y), narrow(z), 0.0];
        i += 1;
    }
    all
}

/// One octave's lattice: how metres become cells, and which random field fills them.
#[derive(Clone, Copy)]
pub(super) struct Lattice {
    rows: [DVec3; 3],
    offset: DVec3,
    cells_per_m: f64,
    seed: u64,
}

/// The four corners of the simplex around a point: offsets to them and their hashes.
struct Corners {
    dx: [f64; 4],
    dy: [f64; 4],
    dz: [f64; 4],
    hash: [u64; 4],
}

/// The cell around a point: offsets from its first corner, sum of that corner's coordinates and
/// seed, and which of the cell's simplices holds the point.
#[derive(Clone, Copy)]
pub(super) struct Cell {
    at: [f64; 3],
    base: u64,
    order: usize,
}

/// Several lattices side by side, so that one instruction serves two of them.
pub(super) struct Lattices<const N: usize> {
    rows: [[[f64; N]; 3]; 3],
    offset: [[f64; N]; 3],
    seed: [u64; N],
}

impl<const N: usize> Lattices<N> {
    pub(super) fn new(each: [Lattice; N]) -> Lattices<N> {
        Lattices {
            rows: [0, 1, 2].map(|row| [0, 1, 2].map(|axis| each.map(|l| l.rows[row][axis]))),
            offset: [0, 1, 2].map(|axis| each.map(|l| l.offset[axis])),
            seed: each.map(|l| l.seed),
        }
    }

    /// The cell of every lattice around a point, same bits as [`Lattice::cell`].
    #[inline(always)]
    pub(super) fn cells(&self, at_m: DVec3) -> [Cell; N] {
        // Plain loops: closures over arrays are not always inlined, which costs a fifth.
        let mut cells = [Cell { at: [0.0; 3], base: 0, order: 0 }; N];
        let mut at = [[0.0; 3]; N];
        for (axis, (rows, offset)) in self.rows.iter().zip(&self.offset).enumerate() {
            for k in 0..N {
                let along = rows[0][k] * at_m.x + rows[1][k] * at_m.y + rows[2][k] * at_m.z;
                at[k][axis] = along + offset[k];
            }
        }
        for k in 0..N {
            cells[k] = cell(at[k], self.seed[k]);
        }
        cells
    }

    /// The cell of one lattice around a point.
    #[inline(always)]
    pub(super) fn cell(&self, k: usize, at_m: DVec3) -> Cell {
        let along = |rows: &[[f64; N]; 3], offset: &[f64; N]| {
            rows[0][k] * at_m.x + rows[1][k] * at_m.y + rows[2][k] * at_m.z + offset[k]
        };
        let ([x, y, z], [dx, dy, dz]) = (&self.rows, &self.offset);
        let at = [along(x, dx), along(y, dy), along(z, dz)];
        cell(at, self.seed[k])
    }

    /// [`Cell::fine_value`] of every lattice at a point.
    #[inline(always)]
    pub(super) fn fine_values(&self, at_m: DVec3) -> [f64; N] {
        let cells = self.cells(at_m);
        let mut values = [0.0; N];
        for k in 0..N {
            values[k] = cells[k].fine_value();
        }
        values
    }

    /// [`Cell::narrow_value`] of every lattice at a point.
    #[inline(always)]
    pub(super) fn narrow_values(&self, at_m: DVec3) -> [f64; N] {
        let cells = self.cells(at_m);
        let mut values = [0.0; N];
        for k in 0..N {
            values[k] = cells[k].narrow_value();
        }
        values
    }
}

/// One of the six simplices of a cell: what to add to a point's offset to see it from each corner,
/// and what the corners' hashes add.
#[derive(Clone, Copy)]
pub(super) struct Simplex {
    offsets: [[f64; 4]; 3],
    narrow: [[f32; 4]; 3],
    steps: [u64; 4],
}

/// By which of x >= y, y >= z and x >= z hold, as bits 0 to 2. Two of the eight cannot happen.
static SIMPLICES: [Simplex; 8] = {
    let mut all = [simplex(0); 8];
    let mut order = 0;
    while order < 8 {
        all[order] = simplex(order);
        order += 1;
    }
    all
};

/// Made out of nothing but choices, so that many at once need no table; and without loops, whose
/// checked counters would keep the compiler from making vectors of them.
#[inline(always)]
const fn simplex(order: usize) -> Simplex {
    let (xy, yz, xz) = (order & 1 != 0, order & 2 != 0, order & 4 != 0);
    // Which coordinates are largest and which are not smallest orders the inner corners.
    let [x1, y1, z1] = [xy & xz, !xy & yz, !yz & !xz];
    let [x2, y2, z2] = [xy | xz, !xy | yz, !(yz & xz)];
    let one = step(x1, PRIME_X).wrapping_add(step(y1, PRIME_Y)).wrapping_add(step(z1, PRIME_Z));
    let two = step(x2, PRIME_X).wrapping_add(step(y2, PRIME_Y)).wrapping_add(step(z2, PRIME_Z));
    let all = PRIME_X.wrapping_add(PRIME_Y).wrapping_add(PRIME_Z);
    Simplex {
        offsets: [offsets(x1, x2), offsets(y1, y2), offsets(z1, z2)],
        narrow: [narrow_offsets(x1, x2), narrow_offsets(y1, y2), narrow_offsets(z1, z2)],
        steps: [0, one, two, all],
    }
}

#[inline(always)]
const fn step(along: bool, prime: u64) -> u64 {
    if along { prime } else { 0 }
}

#[inline(always)]
const fn offsets(one: bool, two: bool) -> [f64; 4] {
    let one = if one { SIXTH - 1.0 } else { SIXTH };
    [0.0, one, if two { THIRD - 1.0 } else { THIRD }, -0.5]
}

#[inline(always)]
const fn narrow_offsets(one: bool, two: bool) -> [f32; 4] {
    let one = if one { SIXTH32 - 1.0 } else { SIXTH32 };
    [0.0, one, if two { THIRD32 - 1.0 } else { THIRD32 }, -0.5]
}

impl Lattice {
    /// A randomly turned and shifted lattice of cells about `wavelength_m` apart. Every octave is
    /// turned by itself, so that no direction of the lattices shows and none meet at the origin.
    pub(super) fn new(wavelength_m: f64, seed: u64) -> Lattice {
        let mut state = mix(seed ^ PRIME_Y);
        let mut next = || {
            state = mix(state.wrapping_add(PRIME_X));
            unit(state) * 2.0 - 1.0
        };
        let mut in_ball = || loop {
            let v = DVec3::new(next(), next(), next());
            if (0.1..=1.0).contains(&v.length_squared()) {
                return v;
            }
        };
        let a = in_ball().normalize();
        let mut b = a.cross(in_ball());
        while b.length_squared() < 0.01 {
            b = a.cross(in_ball());
        }
        let b = b.normalize();
        let per_m = 1.0 / wavelength_m;
        let rows = [a * per_m, b * per_m, a.cross(b) * per_m];
        let offset = in_ball() * 1000.0;
        Lattice { rows, offset, cells_per_m: per_m, seed: mix(seed ^ PRIME_Z) }
    }

    /// Smooth noise at a point in metres; within [`PEAK`], 0 on average.
    #[inline(always)]
    pub(super) fn value(&self, at_m: DVec3) -> f64 {
        self.cell(at_m).value()
    }

    /// [`Lattice::value`] and its gradient per metre.
    #[inline(always)]
    pub(super) fn value_and_gradient(&self, at_m: DVec3) -> (f64, DVec3) {
        let (value, slope) = self.cell(at_m).value_and_gradient();
        (value, self.per_metre(slope))
    }

    /// Stripes that run across `side` (a vector of length 0..1 in the axes of `at_m`): -1..1, and
    /// the change per metre along `side`. A short `side` widens the stripes, zero makes one value
    /// per blot. Random phases sit on the lattice, so stripes fork and join.
    #[inline(always)]
    pub(super) fn stripes(&self, at_m: DVec3, side: DVec3) -> (f64, DVec3) {
        let cell = self.cell(at_m);
        self.stripes_in(&cell, cell.looked_up(), side)
    }

    /// [`Lattice::stripes`] in a cell and its simplex.
    #[inline(always)]
    pub(super) fn stripes_in(&self, cell: &Cell, simplex: &Simplex, side: DVec3) -> (f64, DVec3) {
        let c = cell.corners(simplex);
        let across =
            DVec3::new(self.rows[0].dot(side), self.rows[1].dot(side), self.rows[2].dot(side));
        let turns_per_offset = TURNS_PER_CELL / self.cells_per_m;
        let (mut weights, mut sum, mut slope) = (0.0, 0.0, 0.0);
        for i in 0..4 {
            let t = kernel(&c, i);
            let w = t * t * t;
            let phase = across.x * c.dx[i] + across.y * c.dy[i] + across.z * c.dz[i];
            let turns = phase * turns_per_offset + unit(c.hash[i]);
            weights += w;
            sum += w * cosine(turns);
            slope -= w * sine(turns);
        }
        let inverse = 1.0 / weights;
        let per_m = TURNS_PER_CELL * core::f64::consts::TAU * self.cells_per_m;
        (sum * inverse, side * (slope * inverse * per_m))
    }

    /// A gradient per metre, from one in the lattice's own units.
    #[inline(always)]
    pub(super) fn per_metre(&self, slope: DVec3) -> DVec3 {
        self.rows[0] * slope.x + self.rows[1] * slope.y + self.rows[2] * slope.z
    }

    #[inline(always)]
    pub(super) fn cell(&self, at_m: DVec3) -> Cell {
        let along = |row: DVec3| row.x * at_m.x + row.y * at_m.y + row.z * at_m.z;
        let [x, y, z] = self.rows.map(along);
        cell([x + self.offset.x, y + self.offset.y, z + self.offset.z], self.seed)
    }
}

impl Cell {
    /// Noise at the cell's point; see [`Lattice::value`].
    #[inline(always)]
    pub(super) fn value(&self) -> f64 {
        self.value_in(self.looked_up())
    }

    /// [`Cell::value`] in the cell's simplex.
    #[inline(always)]
    pub(super) fn value_in(&self, simplex: &Simplex) -> f64 {
        let c = self.corners(simplex);
        let mut sum = 0.0;
        for i in 0..4 {
            let g = gradient(c.hash[i]);
            let t = kernel(&c, i);
            let t2 = t * t;
            sum += t2 * t2 * (g[0] * c.dx[i] + g[1] * c.dy[i] + g[2] * c.dz[i]);
        }
        SCALE * sum
    }

    /// [`Cell::value`] and its gradient in the lattice's own units.
    #[inline(always)]
    pub(super) fn value_and_gradient(&self) -> (f64, DVec3) {
        self.value_and_gradient_in(self.looked_up())
    }

    /// [`Cell::value_and_gradient`] in the cell's simplex.
    #[inline(always)]
    pub(super) fn value_and_gradient_in(&self, simplex: &Simplex) -> (f64, DVec3) {
        let c = self.corners(simplex);
        let mut sum = 0.0;
        let mut slope = DVec3::ZERO;
        for i in 0..4 {
            let g = gradient(c.hash[i]);
            let t = kernel(&c, i);
            let t2 = t * t;
            let dot = g[0] * c.dx[i] + g[1] * c.dy[i] + g[2] * c.dz[i];
            let fall = -8.0 * t2 * t * dot;
            let t4 = t2 * t2;
            sum += t4 * dot;
            slope.x += t4 * g[0] + fall * c.dx[i];
            slope.y += t4 * g[1] + fall * c.dy[i];
            slope.z += t4 * g[2] + fall * c.dz[i];
        }
        (SCALE * sum, slope * SCALE)
    }

    /// [`Cell::value`] within 1e-6, where that does not matter: f32, four corners at a time.
    #[inline(always)]
    pub(super) fn narrow_value(&self) -> f64 {
        self.narrow_value_in(self.looked_up())
    }

    /// [`Cell::narrow_value`] in the cell's simplex.
    #[inline(always)]
    pub(super) fn narrow_value_in(&self, simplex: &Simplex) -> f64 {
        self.narrow_with(simplex, mix)
    }

    /// As precise and faster, but another noise of the same kind.
    #[inline(always)]
    pub(super) fn fine_value(&self) -> f64 {
        self.fine_value_in(self.looked_up())
    }

    /// [`Cell::fine_value`] in the cell's simplex.
    #[inline(always)]
    pub(super) fn fine_value_in(&self, simplex: &Simplex) -> f64 {
        self.narrow_with(simplex, half_mix)
    }

    /// The simplex that holds the point, from a table: the faster way for one point.
    #[inline(always)]
    fn looked_up(&self) -> &'static Simplex {
        &SIMPLICES[self.order]
    }

    /// The same, made anew: the faster way for many points at once.
    #[inline(always)]
    pub(super) fn simplex(&self) -> Simplex {
        simplex(self.order)
    }

    #[inline(always)]
    fn narrow_with(&self, simplex: &Simplex, scramble: impl Fn(u64) -> u64) -> f64 {
        let [ox, oy, oz] = &simplex.narrow;
        let [x, y, z] = self.at.map(narrow);
        let slots = simplex.steps.map(|step| slot(scramble(self.base.wrapping_add(step))));
        let g = slots.map(|slot| &GRADIENTS_F32[slot]);
        let mut parts = [0.0_f32; 4];
        for i in 0..4 {
            let (dx, dy, dz) = (x + ox[i], y + oy[i], z + oz[i]);
            let t = 0.5 - dx * dx - dy * dy - dz * dz;
            let t = if t > 0.0 { t } else { 0.0 };
            let t2 = t * t;
            parts[i] = t2 * t2 * (g[i][0] * dx + g[i][1] * dy + g[i][2] * dz);
        }
        SCALE * f64::from((parts[0] + parts[1]) + (parts[2] + parts[3]))
    }

    #[inline(always)]
    fn corners(&self, simplex: &Simplex) -> Corners {
        let [x, y, z] = self.at;
        let [ox, oy, oz] = &simplex.offsets;
        Corners {
            dx: ox.map(|o| x + o),
            dy: oy.map(|o| y + o),
            dz: oz.map(|o| z + o),
            hash: simplex.steps.map(|step| mix(self.base.wrapping_add(step))),
        }
    }
}

/// The cell around a point in a lattice's own units.
#[inline(always)]
fn cell([x, y, z]: [f64; 3], seed: u64) -> Cell {
    let skew = (x + y + z) * (1.0 / 3.0) - 0.5;
    let (bx, by, bz) = (x + skew + ROUND, y + skew + ROUND, z + skew + ROUND);
    let (fx, fy, fz) = (bx - ROUND, by - ROUND, bz - ROUND);
    let unskew = (fx + fy + fz) * SIXTH;
    let (x0, y0, z0) = (x - fx + unskew, y - fy + unskew, z - fz + unskew);
    let order = usize::from(x0 >= y0) | (usize::from(y0 >= z0) << 1) | (usize::from(x0 >= z0) << 2);
    let base = bx
        .to_bits()
        .wrapping_mul(PRIME_X)
        .wrapping_add(by.to_bits().wrapping_mul(PRIME_Y))
        .wrapping_add(bz.to_bits().wrapping_mul(PRIME_Z))
        .wrapping_add(seed);
    Cell { at: [x0, y0, z0], base, order }
}

/// Turns of a stripe phase per cell of its lattice, for a `side` of length 1.
const TURNS_PER_CELL: f64 = 1.0;

/// Scrambles 64 bits (the finaliser of splitmix64, shortened by one shift).
#[inline(always)]
pub(super) fn mix(bits: u64) -> u64 {
    let a = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    (a ^ (a >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB)
}

/// Scrambles the top bits well enough to pick a gradient.
#[inline(always)]
fn half_mix(bits: u64) -> u64 {
    (bits ^ (bits >> 32)).wrapping_mul(0xBF58_476D_1CE4_E5B9)
}

/// The top 52 bits of a hash as a number in 0..1.
#[inline(always)]
pub(super) fn unit(hash: u64) -> f64 {
    f64::from_bits((hash >> 12) | 0x3FF0_0000_0000_0000) - 1.0
}

/// Nearest integer, ties to even.
#[inline(always)]
pub(super) fn round(x: f64) -> f64 {
    (x + ROUND) - ROUND
}

/// 0 up to `low`, 1 from `high`, a cubic with level ends between.
#[inline(always)]
pub(super) fn ramp(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[inline(always)]
fn gradient(hash: u64) -> &'static [f64; 4] {
    &GRADIENTS[slot(hash)]
}

#[inline(always)]
fn slot(hash: u64) -> usize {
    (hash >> 59) as usize
}

#[inline(always)]
fn kernel(c: &Corners, i: usize) -> f64 {
    let t = 0.5 - c.dx[i] * c.dx[i] - c.dy[i] * c.dy[i] - c.dz[i] * c.dz[i];
    if t > 0.0 { t } else { 0.0 }
}

/// Parabolas in place of the sine of `turns` full turns; off by 0.06 at most, slopes continuous.
#[inline(always)]
fn sine(turns: f64) -> f64 {
    let u = turns - round(turns);
    8.0 * u - 16.0 * u * u.abs()
}

#[inline(always)]
fn cosine(turns: f64) -> f64 {
    sine(turns + 0.25)
}
