//! Where the boxes of a graph go: layers from top to bottom, few crossings, short and straight lines.
//!
//! ```text
//!   layer 0      [a]     [b]         1. layers by the longest path; boxes without inputs sink towards their readers
//!   layer 1    [c]  |   [d]          2. lines that pass a layer by get a place in it (|), one for all readers of a net
//!   layer 2      [ e ]               3. order within layers by the mean of the neighbours, up and down, the best kept
//!                                    4. places by least squares in that order: isotonic regression per layer
//! ```
//!
//! The frame of \[Sug81\] with the heuristics that need the least code. Step 4 takes the place of the priorities of
//! the original: for an order and the neighbours' places, pooling adjacent violators finds the best places exactly, in
//! linear time. Network simplex gives shorter lines, and takes minutes for frames of a thousand passes.
//!
//! \[Sug81\]: <https://doi.org/10.1109/TSMC.1981.4308636> "Sugiyama, Tagawa, Toda, Methods for visual understanding of hierarchical
//! system structures, 1981"

use super::place::place;

/// A box.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Size {
    pub(super) width: f32,
    pub(super) height: f32,
}

/// Lines from one place on a box's lower edge to the upper edges of others, which all come later in the list of boxes.
#[derive(Clone, Debug)]
pub(super) struct Net {
    pub(super) from: usize,
    /// Where on the lower edge (px from the box's left).
    pub(super) port: f32,
    /// Each box once.
    pub(super) to: Vec<usize>,
}

/// Places (px).
#[derive(Debug, Default)]
pub(super) struct Layout {
    pub(super) size: Size,
    /// Upper left corner of each box.
    pub(super) corners: Vec<[f32; 2]>,
    /// Per net and target: the points its line goes through, in pairs of a curve's end and the next one's start.
    pub(super) lines: Vec<Vec<Vec<[f32; 2]>>>,
}

/// Room of a line that passes a layer by (px).
pub(super) const LINE: f32 = 9.0;
/// Around everything (px).
const MARGIN: f32 = 16.0;
/// Orders tried.
const SWEEPS: usize = 12;

/// What stands in a layer.
#[derive(Clone, Debug, Default)]
pub(super) struct Item {
    pub(super) width: f32,
    /// Links to the layer above: item there, and where its line starts from that item's middle.
    pub(super) above: Vec<(usize, f32)>,
    /// Links to the layer below: item there, and where the line starts from the middle of this one.
    pub(super) below: Vec<(usize, f32)>,
    /// Middle (px).
    pub(super) x: f32,
}

/// Lays out `boxes`, joined by `nets`.
pub(super) fn layout(boxes: &[Size], nets: &[Net]) -> Layout {
    if boxes.is_empty() {
        return Layout::default();
    }
    let layer_of = layers(boxes.len(), nets);
    let (mut items, passing) = items(boxes, nets, &layer_of);
    let mut rows: Vec<Vec<usize>> = vec![Vec::new(); layer_of.iter().max().map_or(0, |last| last + 1)];
    for (index, &layer) in layer_of.iter().enumerate() {
        rows[layer].push(index);
    }
    for (net, first) in nets.iter().zip(&passing) {
        for (step, item) in first.clone().enumerate() {
            rows[layer_of[net.from] + 1 + step].push(item);
        }
    }
    order(&mut rows, &items);
    place(&rows, &mut items);
    finish(boxes, nets, &layer_of, &rows, &items, &passing)
}

/// Longest path from above; then what has no inputs goes down to just above its first reader.
fn layers(count: usize, nets: &[Net]) -> Vec<usize> {
    let mut outgoing: Vec<Vec<usize>> = vec![Vec::new(); count];
    let mut has_input = vec![false; count];
    for net in nets {
        outgoing[net.from].extend(&net.to);
        net.to.iter().for_each(|&to| has_input[to] = true);
    }
    let mut layer_of = vec![0_usize; count];
    for from in 0..count {
        for &to in &outgoing[from] {
            layer_of[to] = layer_of[to].max(layer_of[from] + 1);
        }
    }
    for index in (0..count).rev().filter(|&index| !has_input[index]) {
        if let Some(first) = outgoing[index].iter().map(|&to| layer_of[to]).min() {
            layer_of[index] = first.saturating_sub(1);
        }
    }
    layer_of
}

/// Boxes and, behind them, the lines' places in the layers they pass by: a range per net, from its first layer down.
fn items(boxes: &[Size], nets: &[Net], layer_of: &[usize]) -> (Vec<Item>, Vec<std::ops::Range<usize>>) {
    let mut items: Vec<Item> = boxes.iter().map(|size| Item { width: size.width, ..Item::default() }).collect();
    let mut passing = Vec::with_capacity(nets.len());
    for net in nets {
        let start = layer_of[net.from];
        let last = net.to.iter().map(|&to| layer_of[to]).max().unwrap_or(start);
        let range = items.len()..items.len() + last.saturating_sub(start + 1);
        items.extend(range.clone().map(|_| Item { width: LINE, ..Item::default() }));
        let port = net.port - boxes[net.from].width / 2.0;
        let mut link = |from: usize, to: usize| {
            let offset = if from == net.from { port } else { 0.0 };
            items[from].below.push((to, offset));
            items[to].above.push((from, offset));
        };
        let above = |layer: usize| if layer == start + 1 { net.from } else { range.start + layer - start - 2 };
        range.clone().enumerate().for_each(|(step, item)| link(above(start + 1 + step), item));
        net.to.iter().for_each(|&to| link(above(layer_of[to]), to));
        passing.push(range);
    }
    (items, passing)
}

/// Reorders each row by the mean position of its items' neighbours, and keeps the order with the fewest crossings.
fn order(rows: &mut Vec<Vec<usize>>, items: &[Item]) {
    let mut position = vec![0_usize; items.len()];
    let renumber = |row: &[usize], position: &mut [usize]| row.iter().enumerate().for_each(|(at, &item)| position[item] = at);
    for row in rows.iter() {
        renumber(row, &mut position);
    }
    let (mut best, mut fewest) = (rows.clone(), crossings(rows, items, &position));
    for sweep in 0..SWEEPS {
        let down = sweep % 2 == 0;
        for step in 0..rows.len() {
            let row = if down { step } else { rows.len() - 1 - step };
            let mean = |item: usize| {
                let links = if down { &items[item].above } else { &items[item].below };
                let sum: usize = links.iter().map(|(other, _)| position[*other]).sum();
                if links.is_empty() { position[item] as f32 } else { sum as f32 / links.len() as f32 }
            };
            let mut keyed: Vec<(f32, usize)> = rows[row].iter().map(|&item| (mean(item), item)).collect();
            keyed.sort_by(|a, b| a.0.total_cmp(&b.0));
            rows[row] = keyed.into_iter().map(|(_, item)| item).collect();
            renumber(&rows[row], &mut position);
        }
        let count = crossings(rows, items, &position);
        if count < fewest {
            (best, fewest) = (rows.clone(), count);
        }
    }
    *rows = best;
}

/// Pairs of links between adjacent rows that cross, counted by a Fenwick tree over the lower row.
fn crossings(rows: &[Vec<usize>], items: &[Item], position: &[usize]) -> u64 {
    let mut total = 0;
    for pair in rows.windows(2) {
        let mut tree = vec![0_u64; pair[1].len() + 1];
        let mut seen = 0;
        for &item in &pair[0] {
            let mut ends: Vec<usize> = items[item].below.iter().map(|(other, _)| position[*other]).collect();
            ends.sort_unstable();
            for &end in &ends {
                let (mut at, mut left) = (end + 1, 0);
                while at > 0 {
                    left += tree[at];
                    at &= at - 1;
                }
                total += seen - left;
            }
            for &end in &ends {
                let mut at = end + 1;
                while at < tree.len() {
                    tree[at] += 1;
                    at += at & at.wrapping_neg();
                }
                seen += 1;
            }
        }
    }
    total
}

fn finish(
    boxes: &[Size],
    nets: &[Net],
    layer_of: &[usize],
    rows: &[Vec<usize>],
    items: &[Item],
    passing: &[std::ops::Range<usize>],
) -> Layout {
    let left = items.iter().map(|item| item.x - item.width / 2.0).fold(f32::INFINITY, f32::min);
    let right = items.iter().map(|item| item.x + item.width / 2.0).fold(f32::NEG_INFINITY, f32::max);
    let shift = MARGIN - left;
    // Rows apart by how far their lines go sideways, so that curves do not lie flat.
    let mut tops = Vec::with_capacity(rows.len());
    let mut heights = Vec::with_capacity(rows.len());
    let mut y = MARGIN;
    for row in rows {
        let height = row.iter().filter_map(|&item| boxes.get(item)).map(|size| size.height).fold(0.0, f32::max);
        let sideways = row.iter().flat_map(|&item| {
            items[item].below.iter().map(move |(other, offset)| (items[*other].x - items[item].x - offset).abs())
        });
        tops.push(y);
        heights.push(height);
        y += height + 34.0 + (sideways.fold(0.0, f32::max) * 0.05).min(46.0);
    }
    let corner = |index: usize| [items[index].x - boxes[index].width / 2.0 + shift, tops[layer_of[index]]];
    let corners: Vec<[f32; 2]> = (0..boxes.len()).map(corner).collect();
    // Where lines enter a box: side by side, in the order in which they come.
    let mut entries: Vec<Vec<(f32, usize)>> = vec![Vec::new(); boxes.len()];
    for (index, net) in nets.iter().enumerate() {
        for &to in &net.to {
            let last = layer_of[to] - layer_of[net.from];
            let from = if last == 1 { corners[net.from][0] + net.port } else { items[passing[index].start + last - 2].x + shift };
            entries[to].push((from, index));
        }
    }
    for entry in &mut entries {
        entry.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    let enter = |to: usize, net: usize| {
        let count = entries[to].len() as f32;
        let at = entries[to].iter().position(|(_, index)| *index == net).unwrap_or(0) as f32;
        let spacing = ((boxes[to].width - 20.0) / count).min(11.0);
        corners[to][0] + boxes[to].width / 2.0 + (at - (count - 1.0) / 2.0) * spacing
    };
    let line = |index: usize, to: usize| {
        let net = &nets[index];
        let start = layer_of[net.from];
        let mut points = vec![[corners[net.from][0] + net.port, corners[net.from][1] + boxes[net.from].height]];
        for layer in start + 1..layer_of[to] {
            let x = items[passing[index].start + layer - start - 1].x + shift;
            points.extend([[x, tops[layer]], [x, tops[layer] + heights[layer]]]);
        }
        points.push([enter(to, index), corners[to][1]]);
        points
    };
    let lines = nets.iter().enumerate().map(|(index, net)| net.to.iter().map(|&to| line(index, to)).collect()).collect();
    Layout { size: Size { width: right + shift + MARGIN, height: y - 34.0 + MARGIN }, corners, lines }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: Size = Size { width: 100.0, height: 40.0 };

    fn net(from: usize, to: &[usize]) -> Net {
        Net { from, port: 50.0, to: to.to_vec() }
    }

    fn tops(layout: &Layout) -> Vec<f32> {
        layout.corners.iter().map(|corner| corner[1]).collect()
    }

    #[test]
    fn boxes_stand_below_what_they_read_and_never_overlap() {
        // Random graphs by a linear congruence: box `i` reads from up to three earlier ones.
        let mut state = 7_u32;
        let mut random = |below: usize| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 16) as usize % below
        };
        for count in [1, 2, 10, 60] {
            let sizes: Vec<Size> = (0..count).map(|_| Size { width: 80.0 + random(90) as f32, height: 40.0 }).collect();
            let mut nets: Vec<Net> = (0..count).map(|from| net(from, &[])).collect();
            for to in 1..count {
                for from in [random(to), random(to)] {
                    if !nets[from].to.contains(&to) {
                        nets[from].to.push(to);
                    }
                }
            }
            let layout = layout(&sizes, &nets);
            for net in &nets {
                for &to in &net.to {
                    assert!(layout.corners[net.from][1] + 40.0 < layout.corners[to][1], "{} is not above {to}", net.from);
                }
            }
            for (a, corner) in layout.corners.iter().enumerate() {
                assert!(corner[0] >= 0.0 && corner[0] + sizes[a].width <= layout.size.width, "{a} lies outside");
                for b in 0..a {
                    let other = layout.corners[b];
                    let clear = corner[0] + sizes[a].width <= other[0] + 0.01 || other[0] + sizes[b].width <= corner[0] + 0.01;
                    assert!((corner[1] - other[1]).abs() > 1.0 || clear, "{a} and {b} of {count} overlap");
                }
            }
        }
    }

    #[test]
    fn a_chain_is_straight_and_a_late_source_sinks() {
        let layout = layout(&[BOX; 4], &[net(0, &[1]), net(1, &[3]), net(2, &[3])]);
        let y = tops(&layout);
        assert!(y[0] < y[1] && y[1] < y[3], "{y:?}");
        assert!((y[2] - y[1]).abs() < 0.5, "box 2 stands just above its only reader: {y:?}");
        assert!((layout.corners[0][0] - layout.corners[1][0]).abs() < 0.5, "{:?}", layout.corners);
    }

    #[test]
    fn crossed_wires_are_uncrossed() {
        let nets = [net(0, &[3]), net(1, &[2])];
        let layout = layout(&[BOX; 4], &nets);
        let crossed = (layout.corners[0][0] - layout.corners[1][0]) * (layout.corners[3][0] - layout.corners[2][0]) < 0.0;
        assert!(!crossed, "{:?}", layout.corners);
    }

    #[test]
    fn lines_go_around_the_boxes_between() {
        // 0 → 1 → 2 and 0 → 2: the long line keeps clear of box 1.
        let layout = layout(&[BOX; 3], &[net(0, &[1, 2]), net(1, &[2])]);
        let long = &layout.lines[0][1];
        assert_eq!(long.len(), 4, "start, two points beside box 1, end: {long:?}");
        let x = long[1][0];
        let [left, _] = layout.corners[1];
        assert!(x < left || x > left + BOX.width, "{x} runs through box 1 at {left}");
    }

    #[test]
    fn nothing_is_nothing() {
        assert!(layout(&[], &[]).corners.is_empty(), "no boxes");
    }
}
