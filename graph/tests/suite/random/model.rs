//! A sequential interpreter: what the frames must give. It knows steps and words, and nothing of plans.

use super::case::{Kind, Node, Owner, Step};

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

/// What an imported node holds before the first frame.
pub(super) fn imported(node: usize, kind: Kind) -> Vec<u32> {
    (0..kind.words() as u32).map(|i| mix(node as u32, i)).collect()
}

impl Model {
    pub(super) fn new(nodes: &[Node]) -> Self {
        let words = nodes.iter().enumerate().map(|(index, node)| match node.owner {
            Owner::Imported => imported(index, node.kind),
            _ => vec![0; node.kind.words()],
        });
        Self { words: words.collect(), nodes: nodes.to_vec() }
    }

    /// Runs one frame; what its reads give, in order.
    pub(super) fn frame(&mut self, steps: &[Step]) -> Vec<Vec<u32>> {
        let reads = steps.iter().filter_map(|&step| self.step(step)).collect();
        for previous in (0..self.nodes.len()).filter(|&node| self.nodes[node].owner == Owner::Previous) {
            if steps.iter().any(|step| step.writes().contains(&(previous + 1))) {
                self.words.swap(previous, previous + 1);
            }
        }
        reads
    }

    /// Item `i` of a source, round and round; 0 without one. A texel is the sum of its channels, weighted.
    fn item(&self, from: Option<usize>, i: u32) -> u32 {
        let Some(from) = from else { return 0 };
        let (kind, words) = (self.nodes[from].kind, &self.words[from]);
        let at = (i % kind.items()) as usize;
        match kind {
            Kind::Buffer { .. } => words[at],
            // What a shader loads from a texture of one channel: (r, 0, 0, 1).
            Kind::Texture { channels: 1, .. } => words[at].wrapping_add(7),
            Kind::Texture { .. } => {
                let texel = &words[4 * at..4 * at + 4];
                texel.iter().zip([1, 3, 5, 7]).fold(0_u32, |sum, (word, weight)| sum.wrapping_add(word.wrapping_mul(weight)))
            }
        }
    }

    fn set(&mut self, to: usize, i: u32, value: u32) {
        let channels = self.nodes[to].kind.channels();
        for channel in 0..channels {
            self.words[to][(i * channels + channel) as usize] = if channel == 0 { value } else { mix(value, channel) };
        }
    }

    fn step(&mut self, step: Step) -> Option<Vec<u32>> {
        match step {
            Step::Compute { to, from, uniform, count, seed } => {
                for i in 0..count {
                    // Uniforms are the first 16 words.
                    let first = self.item(from[0], if uniform { i % 16 } else { i });
                    self.set(to, i, mix(mix(mix(seed, i), first), self.item(from[1], i)));
                }
            }
            Step::Update { to, from, count, seed } => {
                for i in 0..count {
                    let value = mix(mix(seed, i), self.item(from, i));
                    let old = self.words[to][i as usize];
                    self.set(to, i, mix(old, value));
                }
            }
            Step::Draw { to, from, clear, columns, seed } => {
                for (location, to) in to.into_iter().enumerate().filter_map(|(n, to)| Some((n as u32, to?))) {
                    let Kind::Texture { size: [width, height], .. } = self.nodes[to].kind else { continue };
                    if let Some(clear) = clear {
                        self.words[to].fill(clear);
                    }
                    for i in (0..width * height).filter(|i| i % width < columns) {
                        self.set(to, i, mix(mix(seed.wrapping_add(location), i), self.item(from, i)));
                    }
                }
            }
            Step::Clear { to } => self.words[to].fill(0),
            Step::Copy { to, from } => self.words[to] = self.words[from].clone(),
            Step::Closure { to, from, words } => {
                let words = words as usize;
                let copied = self.words[from][..words].to_vec();
                self.words[to][..words].copy_from_slice(&copied);
            }
            Step::Read { from } => return Some(self.words[from].clone()),
        }
        None
    }
}
