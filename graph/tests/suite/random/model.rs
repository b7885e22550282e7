//! A sequential interpreter: what the frames must give. It knows steps and words, and nothing of plans.

use super::{
    case::{Bind, Step},
    node::{Kind, Node, Owner, Part},
};

/// The words of every node. Those no step has written hold a pattern that no result may depend on.
pub(super) struct Model {
    nodes: Vec<Node>,
    words: Vec<Vec<u32>>,
}

/// The hash that the shaders use: see `HASH` in `kernels.rs`.
fn mix(a: u32, b: u32) -> u32 {
    let h = (a ^ b.wrapping_mul(0x9e37_79b1)).wrapping_mul(0x85eb_ca6b);
    h ^ (h >> 15)
}

/// What an imported node holds before the first frame, or one whose first contents are given.
pub(super) fn first(node: usize, kind: Kind) -> Vec<u32> {
    (0..kind.words() as u32).map(|i| mix(node as u32, i)).collect()
}

/// The depth of a draw, in eighths.
pub(super) fn depth(seed: u32) -> u32 {
    (seed >> 8) % 8
}

impl Model {
    pub(super) fn new(nodes: &[Node]) -> Self {
        let words = nodes.iter().enumerate().map(|(index, node)| match node.owner {
            Owner::Imported => first(index, node.kind),
            Owner::Previous | Owner::Persistent if node.filled => {
                let mut words = first(index, node.kind);
                words[node.kind.first_mip()..].fill(0);
                words
            }
            _ => vec![0; node.kind.words()],
        });
        Self { words: words.collect(), nodes: nodes.to_vec() }
    }

    /// Runs one frame; what its reads give, in order.
    pub(super) fn frame(&mut self, steps: &[Step]) -> Vec<Vec<u32>> {
        let reads = steps.iter().filter_map(|&step| self.step(step)).collect();
        for previous in (0..self.nodes.len()).filter(|&node| self.nodes[node].owner == Owner::Previous) {
            if steps.iter().any(|step| step.writes().iter().any(|part| part.node == previous + 1)) {
                self.words.swap(previous, previous + 1);
            }
        }
        reads
    }

    /// Item `i` of a source, round and round through its mips and layers; 0 without one. A texel is the sum of its channels,
    /// weighted.
    fn item(&self, from: Option<Part>, i: u32) -> u32 {
        let Some(from) = from else { return 0 };
        let kind = self.nodes[from.node].kind;
        let cells: Vec<usize> = from.cells(kind).collect();
        let words = &self.words[from.node][kind.range(cells[i as usize % cells.len()])];
        let channels = kind.channels() as usize;
        let at = i as usize / cells.len() % (words.len() / channels) * channels;
        match kind {
            Kind::Buffer { .. } | Kind::Depth { .. } => words[at],
            // What a shader loads from a texture of one channel: (r, 0, 0, 1).
            Kind::Texture { channels: 1, .. } => words[at].wrapping_add(7),
            Kind::Texture { .. } => {
                let texel = words[at..at + 4].iter().zip([1, 3, 5, 7]);
                texel.fold(0_u32, |sum, (word, weight)| sum.wrapping_add(word.wrapping_mul(weight)))
            }
        }
    }

    /// The words of a part that is one cell, or of a whole buffer.
    fn cell(&mut self, part: Part) -> &mut [u32] {
        let kind = self.nodes[part.node].kind;
        let range = part.cells(kind).next().map_or(0..0, |cell| kind.range(cell));
        &mut self.words[part.node][range]
    }

    fn set(&mut self, to: Part, i: u32, value: u32) {
        let channels = self.nodes[to.node].kind.channels();
        let cell = self.cell(to);
        for channel in 0..channels {
            cell[(i * channels + channel) as usize] = if channel == 0 { value } else { mix(value, channel) };
        }
    }

    fn step(&mut self, step: Step) -> Option<Vec<u32>> {
        match step {
            Step::Compute { to, from, bind, groups, count, seed, .. } => {
                let covered = groups.map_or(count, |arguments| self.words[arguments][1] * 64);
                for i in 0..count.min(covered) {
                    // Uniforms are the first 16 words.
                    let first = self.item(from[0], if bind == Bind::Uniform { i % 16 } else { i });
                    self.set(to, i, mix(mix(mix(seed, i), first), self.item(from[1], i)));
                }
            }
            Step::Update { to, from, count, seed } => {
                for i in 0..count {
                    let value = mix(mix(seed, i), self.item(from, i));
                    let old = self.cell(to)[i as usize];
                    self.set(to, i, mix(old, value));
                }
            }
            Step::Arguments { to, groups, vertices, seed } => {
                let noise = |i: u32| mix(mix(mix(seed, i), 0), 0);
                let known = [noise(0), groups, 1, 1, vertices, 1, 0, 0];
                let words = (0..self.words[to].len() as u32).map(|i| known.get(i as usize).copied().unwrap_or_else(|| noise(i)));
                self.words[to] = words.collect();
            }
            Step::Draw { .. } => self.draw(step),
            Step::Clear { to, value } => {
                let value = match self.nodes[to.node].kind {
                    Kind::Buffer { .. } => 0,
                    Kind::Texture { .. } => value,
                    Kind::Depth { .. } => (value as f32 / 8.0).to_bits(),
                };
                self.cell(to).fill(value);
            }
            Step::Copy { to, from } => self.words[to] = self.words[from].clone(),
            Step::Closure { to, from, words } => {
                let words = words as usize;
                let copied = self.words[from][..words].to_vec();
                self.words[to][..words].copy_from_slice(&copied);
            }
            Step::Read { from } => return Some(self.words[from.node][..self.nodes[from.node].kind.first_mip()].to_vec()),
        }
        None
    }

    fn draw(&mut self, step: Step) {
        let Step::Draw { to, depth: buffer, from, bind, beside, vertices, clear, columns, seed, .. } = step else { return };
        let attached: Vec<Part> = to.into_iter().flatten().collect();
        let Some(&first) = attached.first() else { return };
        if let Some(clear) = clear {
            for &part in &attached {
                self.cell(part).fill(clear);
            }
            if let Some(buffer) = buffer {
                self.words[buffer].fill(1.0_f32.to_bits());
            }
        }
        if vertices.is_some_and(|arguments| self.words[arguments][4] == 0) {
            return;
        }
        let [width, height] = first.size(self.nodes[first.node].kind);
        for i in (0..width * height).filter(|i| i % width < columns) {
            if let Some(buffer) = buffer {
                let depth = depth(seed) as f32 / 8.0;
                let there = &mut self.words[buffer][i as usize];
                if depth >= f32::from_bits(*there) {
                    continue;
                }
                *there = depth.to_bits();
            }
            let item = self.item(from, if bind == Bind::Uniform { i % 16 } else { i });
            if let Some(word) = beside.and_then(|beside| self.words[beside].get_mut(i as usize)) {
                *word = mix(*word, mix(mix(seed, i), item));
            }
            for (location, &part) in attached.iter().enumerate() {
                self.set(part, i, mix(mix(seed.wrapping_add(location as u32), i), item));
            }
        }
    }
}
