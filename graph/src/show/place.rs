//! Moves the boxes of each layer towards what they are joined with, in the order they stand in.

use super::layers::{Item, LINE};

/// Between boxes of one layer (px).
const GAP: f32 = 22.0;
/// Rounds of moving towards the neighbours.
const ROUNDS: usize = 12;

/// Moves items towards their neighbours, row by row, without changing the order.
pub(super) fn place(rows: &[Vec<usize>], items: &mut [Item]) {
    for row in rows {
        let mut x = 0.0;
        for &item in row {
            items[item].x = x + items[item].width / 2.0;
            x += items[item].width + GAP;
        }
    }
    for round in 0..ROUNDS {
        for step in 0..rows.len() {
            let row = &rows[if round % 2 == 0 { step } else { rows.len() - 1 - step }];
            // The first rounds look one way only, which carries a shift through the whole graph.
            let (up, down) = if round + 2 >= ROUNDS { (true, true) } else { (round % 2 == 0, round % 2 == 1) };
            let wanted = |item: usize| {
                let Item { above, below, x, .. } = &items[item];
                let above = above.iter().filter(|_| up).map(|(other, offset)| items[*other].x + offset);
                let below = below.iter().filter(|_| down).map(|(other, offset)| items[*other].x - offset);
                let (sum, count) = above.chain(below).fold((0.0, 0.0), |(sum, count), x| (sum + x, count + 1.0));
                if count == 0.0 { (*x, 0.05) } else { (sum / count, if items[item].width <= LINE { 4.0 } else { 1.0 }) }
            };
            let wanted: Vec<(f32, f32)> = row.iter().map(|&item| wanted(item)).collect();
            let widths: Vec<f32> = row.iter().map(|&item| items[item].width).collect();
            for (&item, x) in row.iter().zip(apart(&wanted, &widths)) {
                items[item].x = x;
            }
        }
    }
}

/// Middles as near to the wanted ones (with weights) as the widths allow, by pooling adjacent violators.
fn apart(wanted: &[(f32, f32)], widths: &[f32]) -> Vec<f32> {
    let mut offsets = Vec::with_capacity(widths.len());
    let mut offset = 0.0;
    for (at, &width) in widths.iter().enumerate() {
        if at > 0 {
            let gap = if width <= LINE && widths[at - 1] <= LINE { 0.0 } else { GAP };
            offset += widths[at - 1] / 2.0 + gap + width / 2.0;
        }
        offsets.push(offset);
    }
    // Pools: (weighted sum, weight, how many).
    let mut pools: Vec<(f32, f32, usize)> = Vec::new();
    for (&(x, weight), offset) in wanted.iter().zip(&offsets) {
        let mut pool = ((x - offset) * weight, weight, 1);
        while let Some(&last) = pools.last()
            && last.0 / last.1 >= pool.0 / pool.1
        {
            pools.pop();
            pool = (last.0 + pool.0, last.1 + pool.1, last.2 + pool.2);
        }
        pools.push(pool);
    }
    let means = pools.iter().flat_map(|&(sum, weight, count)| std::iter::repeat_n(sum / weight, count));
    means.zip(offsets).map(|(mean, offset)| mean + offset).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_fits_stays_and_what_collides_shares_the_way() {
        assert_eq!(middles(&[(50.0, 1.0), (300.0, 1.0)]), [50, 300], "both are where they want to be");
        // Two boxes of 100 with a gap of 22 want one place: each gives way by half of 122.
        assert_eq!(middles(&[(200.0, 1.0), (200.0, 1.0)]), [139, 261]);
        assert_eq!(middles(&[(200.0, 3.0), (200.0, 1.0)])[0], 170, "the heavier gives way less");
    }

    fn middles(wanted: &[(f32, f32)]) -> Vec<i32> {
        apart(wanted, &vec![100.0; wanted.len()]).into_iter().map(|x| x.round() as i32).collect()
    }
}
