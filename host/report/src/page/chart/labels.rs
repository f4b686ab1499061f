//! Placement of labels.

/// Places as near as possible to the `wanted` ones, in the order of `ordered`, at least `distance` apart and within
/// `low..high` if they fit: neighbors that collide are pooled and spread about their mean.
pub(super) fn apart(wanted: &[f64], ordered: &[f64], distance: f64, low: f64, high: f64) -> Vec<f64> {
    let mut order: Vec<usize> = (0..wanted.len()).collect();
    order.sort_by(|&a, &b| ordered[a].total_cmp(&ordered[b]));
    // A pool holds how many labels it has and the sum of where its first one would like to be.
    let mut pools: Vec<(usize, f64)> = Vec::new();
    let start = |pool: &(usize, f64)| {
        let span = (pool.0 - 1) as f64 * distance;
        (pool.1 / pool.0 as f64).min(high - span).max(low)
    };
    for &index in &order {
        let mut pool = (1, wanted[index]);
        while let Some(last) = pools.last() {
            if start(last) + last.0 as f64 * distance <= start(&pool) {
                break;
            }
            let offset = last.0 as f64 * distance;
            pool = (last.0 + pool.0, last.1 + pool.1 - offset * pool.0 as f64);
            pools.pop();
        }
        pools.push(pool);
    }
    let places = pools.iter().flat_map(|pool| {
        let start = start(pool);
        (0..pool.0).map(move |k| start + k as f64 * distance)
    });
    let mut out = vec![0.0; wanted.len()];
    order.iter().zip(places).for_each(|(&index, place)| out[index] = place);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_that_would_collide_are_moved_apart_and_stay_inside() {
        let apart = |wanted: &[f64], distance, low, high| apart(wanted, wanted, distance, low, high);
        let places = apart(&[100.0, 101.0, 50.0, 102.0], 10.0, 0.0, 105.0);
        assert_eq!(places[2], 50.0);
        assert_eq!([places[0], places[1], places[3]], [85.0, 95.0, 105.0]);
        assert_eq!(apart(&[5.0, 30.0], 10.0, 0.0, 100.0), [5.0, 30.0]);
        assert_eq!(apart(&[20.0, 20.0], 10.0, 0.0, 100.0), [15.0, 25.0]);
        assert!(apart(&[], 10.0, 0.0, 1.0).is_empty());
    }
}
