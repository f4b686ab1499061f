//! Cells of a grid about its middle, row by row.

/// Number of cells of a grid with as many on each side of the middle one.
pub(super) fn count([x, y]: [i32; 2]) -> usize {
    ((2 * x + 1) * (2 * y + 1)) as usize
}

/// All cells of a grid.
pub(super) fn places([x, y]: [i32; 2]) -> impl Iterator<Item = [i32; 2]> {
    (-y..=y).flat_map(move |j| (-x..=x).map(move |i| [i, j]))
}

/// The position of a cell in a grid, if it is in it.
pub(super) fn index([x, y]: [i32; 2], [i, j]: [i32; 2]) -> Option<usize> {
    (i.abs() <= x && j.abs() <= y).then(|| ((j + y) * (2 * x + 1) + i + x) as usize)
}

/// Cells of the connected pieces that are at least a twentieth of the largest: noise on the table makes small ones.
pub(super) fn pieces(half: [i32; 2], cells: Vec<[i32; 2]>) -> Vec<[i32; 2]> {
    let mut pieces = connected(half, cells);
    let largest = pieces.iter().map(Vec::len).max().unwrap_or(0);
    pieces.retain(|piece| piece.len() * 20 >= largest);
    pieces.concat()
}

/// Cells by connected pieces.
pub(super) fn connected(half: [i32; 2], cells: Vec<[i32; 2]>) -> Vec<Vec<[i32; 2]>> {
    let mut is_free = vec![false; count(half)];
    cells.iter().filter_map(|at| index(half, *at)).for_each(|cell| is_free[cell] = true);
    let mut pieces = Vec::new();
    for at in cells {
        let mut piece = Vec::new();
        let mut next = vec![at];
        while let Some(at) = next.pop() {
            if let Some(free) = index(half, at).map(|cell| &mut is_free[cell]).filter(|free| **free) {
                *free = false;
                piece.push(at);
                next.extend(places([1, 1]).map(|by| [at[0] + by[0], at[1] + by[1]]));
            }
        }
        pieces.push(piece);
    }
    pieces
}

/// The mean; none of no numbers.
pub(super) fn mean(numbers: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = numbers.fold((0.0, 0), |(sum, count), number| (sum + number, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}
