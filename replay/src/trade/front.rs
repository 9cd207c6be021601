//! The Pareto front: points that no other beats in both error and cost.
//!
//! In:    cost and error of each point.
//! Out:   whether it is on the front.
//! Keeps: nothing.
//! Not here: what counts as cost and error (`yields`).

/// For each (cost, error) whether it is on the front: nothing else is at most as dear and at most
/// as wrong, and better in one of both. Numbers that are not finite are never on it.
pub fn front(points: &[[f64; 2]]) -> Vec<bool> {
    let finite = |p: &[f64; 2]| p.iter().all(|x| x.is_finite());
    let beats = |a: &[f64; 2], b: &[f64; 2]| finite(a) && a[0] <= b[0] && a[1] <= b[1] && a != b;
    points.iter().map(|p| finite(p) && !points.iter().any(|other| beats(other, p))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_is_what_nothing_beats() {
        let points = [[1.0, 9.0], [2.0, 5.0], [3.0, 5.0], [4.0, 1.0], [4.0, 2.0], [f64::NAN, 0.0]];
        assert_eq!(front(&points), [true, true, false, true, false, false]);
        assert_eq!(front(&[[1.0, 1.0], [1.0, 1.0]]), [true, true], "equals do not beat each other");
        assert_eq!(front(&[]), [false; 0]);
    }

    #[test]
    fn every_point_off_the_front_is_beaten_by_one_on_it() {
        let spread = |i: u32| f64::from(i.wrapping_mul(2_654_435_761) >> 20);
        let points: Vec<[f64; 2]> = (0..200).map(|i| [spread(i), spread(i + 1000)]).collect();
        let on = front(&points);
        for (p, _) in points.iter().zip(&on).filter(|(_, on)| !**on) {
            let beaten = points.iter().zip(&on).any(|(q, on)| *on && q[0] <= p[0] && q[1] <= p[1]);
            assert!(beaten, "{p:?}");
        }
    }
}
