//! Two-dimensional packing: blocks with given lifetimes at offsets, so that the whole is as low as can be.
//!
//! ```text
//!   bytes ▲            ┌────┐           A block's extent in time is fixed; only its offset is chosen.
//!         │ ┌────┐     │ d  │           The height is at least the most that is alive at once (here where b, c and d meet),
//!         │ │ b  └─────┤    │           and often a little more, since blocks cannot change their place while they live.
//!         │ └──────────┴────┤
//!         │ ┌────┐ ┌────────┤
//!         │ │ a  │ │   c    │
//!         └─┴────┴─┴────────┴──► position
//! ```
//!
//! Optimal packing is NP-hard, so blocks are placed one after the other at the lowest offset that is free over their life, in
//! several orders: by time, which leaves few holes where lives nest, and by size, which lets the small fill what the large
//! leave. Then the orders are improved: the block that would not stay below the best height so far is placed first of all, and
//! all again. That ends at the lower bound, or when the effort is spent. (This is "squeaky wheel" search; exact solvers were left
//! out, since their time has no bound.)

use std::cmp::Reverse;

/// What is placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Block {
    /// First and last position, inclusive.
    pub(super) first: usize,
    pub(super) last: usize,
    /// Bytes, at least 1.
    pub(super) bytes: u64,
    /// Its offset is a multiple of this, a power of two.
    pub(super) align: u64,
}

impl Block {
    fn duration(&self) -> u64 {
        (self.last - self.first) as u64 + 1
    }
}

/// Offsets, in the order of the blocks, and the height.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Packing {
    pub(super) offsets: Vec<u64>,
    pub(super) height: u64,
}

/// Up to so many blocks, each is compared with all that were placed; beyond, only with those it meets, …
const FEW: usize = 32;
/// … unless there are no more than this many, and they meet more often than so many times each.
const SOME: usize = 512;
const SELDOM: usize = 16;
/// Beyond this many meetings per block, only the order of time is tried.
const CROWD: usize = 512;
/// How many blocks are placed in search of a lower height: this many, and each once …
const EFFORT: usize = 1024;
/// … and so many times as many while the height is more than a hundredth above the bound, …
const MORE: usize = 3;
/// … and as many again as this while it is above the caller's goal.
const MOST: usize = 12;

/// What blocks are sorted by, largest first.
type Key = fn(&Block) -> (u64, u64);

/// Packs blocks sorted by their first position, with more effort while the height is above `goal`.
pub(super) fn pack(blocks: &[Block], goal: u64) -> Packing {
    let bound = bound(blocks);
    let mut by_time: Vec<u32> = (0..blocks.len() as u32).collect();
    by_time.sort_by_key(|&block| (blocks[block as usize].first, Reverse(blocks[block as usize].bytes)));
    let mut best = in_order_of_time(blocks, &by_time);
    if best.height <= bound {
        return best;
    }
    let Some(mut packer) = Packer::new(blocks) else { return best };
    let keys: [Key; 3] = [
        |block| (block.bytes, block.duration()),
        |block| (block.bytes.saturating_mul(block.duration()), block.bytes),
        |block| (block.duration(), block.bytes),
    ];
    let mut orders: [Vec<u32>; 4] = [Vec::new(), Vec::new(), Vec::new(), Vec::new()];
    let (mut spent, enough) = (0, EFFORT + blocks.len());
    loop {
        for (which, order) in orders.iter_mut().enumerate() {
            if order.is_empty() {
                order.clone_from(&by_time);
                if let Some(key) = keys.get(which) {
                    order.sort_by_cached_key(|&block| Reverse(key(&blocks[block as usize])));
                }
            }
            let placed = match packer.place(order, best.height) {
                Ok(height) => {
                    best = Packing { offsets: packer.offsets.clone(), height };
                    blocks.len()
                }
                Err(at) => {
                    order[..=at].rotate_right(1);
                    at + 1
                }
            };
            spent += placed;
            let near = best.height.saturating_sub(bound) <= bound / 100;
            let times = if best.height > goal {
                MOST
            } else if near {
                1
            } else {
                MORE
            };
            if best.height <= bound || spent >= enough * times {
                return best;
            }
        }
    }
}

/// The most alive at once, each block filled up to its alignment: no packing is lower by more than one such filling.
fn bound(blocks: &[Block]) -> u64 {
    let filled = |block: &Block| block.bytes.checked_next_multiple_of(block.align).unwrap_or(u64::MAX);
    let mut ends: Vec<(usize, u64)> = blocks.iter().map(|block| (block.last, filled(block))).collect();
    ends.sort_unstable();
    let (mut live, mut bound, mut ended) = (0_u128, 0_u128, 0);
    for block in blocks {
        while ends[ended].0 < block.first {
            live -= u128::from(ends[ended].1);
            ended += 1;
        }
        live += u128::from(filled(block));
        bound = bound.max(live);
    }
    u64::try_from(bound).unwrap_or(u64::MAX)
}

/// The lowest aligned offset at which `block` lies clear of the ranges `taken`, which come by offset.
fn gap(taken: impl IntoIterator<Item = (u64, u64)>, block: &Block) -> u64 {
    let mut offset = 0_u64;
    for (start, end) in taken {
        if offset.saturating_add(block.bytes) <= start {
            break;
        }
        if end > offset {
            offset = end.checked_next_multiple_of(block.align).unwrap_or(u64::MAX);
        }
    }
    offset
}

/// Places blocks by their first use, where only blocks alive there can be in the way.
fn in_order_of_time(blocks: &[Block], by_time: &[u32]) -> Packing {
    let mut offsets = vec![0; blocks.len()];
    let mut height = 0;
    // Sorted by offset: (offset, end, last position).
    let mut alive: Vec<(u64, u64, usize)> = Vec::new();
    for &index in by_time {
        let block = &blocks[index as usize];
        alive.retain(|&(_, _, last)| last >= block.first);
        let offset = gap(alive.iter().map(|&(offset, end, _)| (offset, end)), block);
        let end = offset.saturating_add(block.bytes);
        height = height.max(end);
        let at = alive.partition_point(|&(other, ..)| other < offset);
        alive.insert(at, (offset, end, block.last));
        offsets[index as usize] = offset;
    }
    Packing { offsets, height }
}

/// A block that was placed.
#[derive(Clone, Copy, Debug)]
struct Lying {
    offset: u64,
    end: u64,
    first: usize,
    last: usize,
}

/// Places blocks in any order.
#[derive(Debug)]
struct Packer<'a> {
    blocks: &'a [Block],
    offsets: Vec<u64>,
    /// Few blocks: those placed, by offset.
    placed: Vec<Lying>,
    /// Many blocks: those each meets; where each one's begin.
    meetings: Vec<u32>,
    starts: Vec<usize>,
}

impl<'a> Packer<'a> {
    /// `None` if the blocks meet too often.
    fn new(blocks: &'a [Block]) -> Option<Self> {
        let mut packer = Self {
            blocks,
            offsets: vec![u64::MAX; blocks.len()],
            placed: Vec::with_capacity(blocks.len()),
            meetings: Vec::new(),
            starts: Vec::new(),
        };
        if blocks.len() <= FEW {
            return Some(packer);
        }
        let some = blocks.len() <= SOME;
        let most = blocks.len() * if some { SELDOM } else { CROWD };
        let mut pairs: Vec<(u32, u32)> = Vec::with_capacity(blocks.len() * 4);
        let mut alive: Vec<u32> = Vec::new();
        for (index, block) in blocks.iter().enumerate() {
            alive.retain(|&other| blocks[other as usize].last >= block.first);
            pairs.extend(alive.iter().map(|&other| (other, index as u32)));
            if pairs.len() > most {
                return some.then_some(packer);
            }
            alive.push(index as u32);
        }
        let mut starts = vec![0; blocks.len() + 2];
        for &(a, b) in &pairs {
            starts[a as usize + 2] += 1;
            starts[b as usize + 2] += 1;
        }
        for at in 2..starts.len() {
            starts[at] += starts[at - 1];
        }
        packer.meetings = vec![0; 2 * pairs.len()];
        for &(a, b) in &pairs {
            for (from, to) in [(a, b), (b, a)] {
                packer.meetings[starts[from as usize + 1]] = to;
                starts[from as usize + 1] += 1;
            }
        }
        packer.starts = starts;
        Some(packer)
    }

    /// The height, if it is below `limit`; else the place in the order of the first block that is not.
    fn place(&mut self, order: &[u32], limit: u64) -> Result<u64, usize> {
        self.placed.clear();
        if !self.starts.is_empty() {
            self.offsets.fill(u64::MAX);
        }
        let mut height = 0;
        let mut taken: Vec<(u64, u64)> = Vec::new();
        for (at, &index) in order.iter().enumerate() {
            let block = &self.blocks[index as usize];
            let offset = if self.starts.is_empty() {
                let meets = |other: &&Lying| other.first <= block.last && block.first <= other.last;
                gap(self.placed.iter().filter(meets).map(|other| (other.offset, other.end)), block)
            } else {
                let others = &self.meetings[self.starts[index as usize]..self.starts[index as usize + 1]];
                taken.clear();
                taken.extend(others.iter().filter(|&&other| self.offsets[other as usize] != u64::MAX).map(|&other| {
                    let offset = self.offsets[other as usize];
                    (offset, offset.saturating_add(self.blocks[other as usize].bytes))
                }));
                taken.sort_unstable();
                gap(taken.iter().copied(), block)
            };
            let end = offset.saturating_add(block.bytes);
            if end >= limit {
                return Err(at);
            }
            height = height.max(end);
            self.offsets[index as usize] = offset;
            if self.starts.is_empty() {
                let place = self.placed.partition_point(|other| other.offset < offset);
                self.placed.insert(place, Lying { offset, end, first: block.first, last: block.last });
            }
        }
        Ok(height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(first: usize, last: usize, bytes: u64) -> Block {
        Block { first, last, bytes, align: 256 }
    }

    #[test]
    fn gaps_are_aligned_and_large_enough() {
        let gap = |taken: &[(u64, u64)], bytes| gap(taken.iter().copied(), &block(0, 0, bytes));
        assert_eq!(gap(&[], 10), 0);
        assert_eq!(gap(&[(0, 100)], 10), 256, "the next multiple of 256");
        assert_eq!(gap(&[(256, 300)], 256), 0, "the front is free");
        assert_eq!(gap(&[(256, 300)], 257), 512, "too long for the front");
        assert_eq!(gap(&[(0, 10), (1024, 1100)], 768), 256, "fits between");
        assert_eq!(gap(&[(0, 900), (256, 300)], 10), 1024, "a range inside another moves nothing back");
        assert_eq!(gap(&[(0, u64::MAX)], 1), u64::MAX, "saturates");
    }

    #[test]
    fn blocks_whose_lives_are_apart_share_an_offset() {
        let packing = pack(&[block(0, 1, 512), block(1, 2, 256), block(2, 3, 512)], u64::MAX);
        assert_eq!(packing, Packing { offsets: vec![0, 512, 0], height: 768 });
        assert_eq!(pack(&[], u64::MAX), Packing { offsets: vec![], height: 0 });
    }

    #[test]
    fn what_the_order_of_time_cannot_do_another_does() {
        // By time, the two small ones of the beginning lie below, and the large one of the end finds no gap between them.
        let blocks = [block(0, 1, 1024), block(0, 3, 512), block(2, 3, 256), block(2, 5, 768), block(4, 5, 768)];
        let by_time: Vec<u32> = (0..5).collect();
        let bound = bound(&blocks);
        assert_eq!(bound, 1536);
        assert!(in_order_of_time(&blocks, &by_time).height > bound, "the example shows something");
        assert_eq!(pack(&blocks, u64::MAX).height, bound);
    }

    #[test]
    fn many_blocks_are_packed_as_soundly_as_few() {
        let mut state = 1_u64;
        let mut below = |n: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 33) % n
        };
        let mut blocks: Vec<Block> = (0..2 * SOME)
            .map(|_| {
                let first = below(2000) as usize;
                Block { first, last: first + below(40) as usize, bytes: 1 + below(100_000), align: 256 << below(3) }
            })
            .collect();
        blocks.sort_by_key(|block| block.first);
        for blocks in [&blocks[..], &blocks[..SOME / 2], &blocks[..FEW]] {
            let packing = pack(blocks, u64::MAX);
            for (n, a) in blocks.iter().enumerate() {
                let offset = packing.offsets[n];
                assert!(offset.is_multiple_of(a.align) && offset + a.bytes <= packing.height, "aligned and inside");
                for (b, &other) in blocks[..n].iter().zip(&packing.offsets) {
                    let meet = a.first <= b.last && b.first <= a.last;
                    assert!(!meet || offset + a.bytes <= other || other + b.bytes <= offset, "{a:?} and {b:?} overlap");
                }
            }
            let ratio = packing.height as f64 / bound(blocks) as f64;
            assert!(ratio < 1.1, "{ratio} times the least");
        }
    }
}
