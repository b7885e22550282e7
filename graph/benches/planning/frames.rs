//! Synthetic frames: the same for the same seed.

use lightloom_graph::Declaration;
use serde_json::{Value, json};

/// A frame being written.
struct Frame {
    name: String,
    resources: Vec<Value>,
    passes: Vec<Value>,
    random: Random,
}

/// Numbers from a seed (xorshift64).
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % n as u64) as usize
    }
}

const FORMATS: [(&str, u64); 6] =
    [("rgba16float", 8), ("rgba8unorm", 4), ("r32float", 4), ("rg11b10ufloat", 4), ("r8unorm", 1), ("rgba32float", 16)];

impl Frame {
    fn new(name: String, seed: usize) -> Self {
        let out =
            json!({"name": "out", "kind": "texture", "origin": "imported", "format": "rgba8unorm", "size": [1920, 1080, 1]});
        let random = Random((seed as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        Self { name, resources: vec![out], passes: Vec::new(), random }
    }

    fn texture(&mut self, format: usize, shift: usize, mips: usize) -> String {
        let name = format!("r{}", self.resources.len());
        let (format, size) = (FORMATS[format].0, [1920 >> shift, 1080 >> shift, 1]);
        self.resources
            .push(json!({"name": name, "kind": "texture", "origin": "transient", "format": format, "size": size, "mips": mips}));
        name
    }

    fn buffer(&mut self, bytes: usize) -> String {
        let name = format!("r{}", self.resources.len());
        self.resources.push(json!({"name": name, "kind": "buffer", "origin": "transient", "bytes": bytes}));
        name
    }

    /// A texture of full, half, quarter or eighth size, or a buffer.
    fn any(&mut self) -> String {
        match self.random.below(10) {
            0..2 => {
                let bytes = (1 + self.random.below(64)) << (8 + self.random.below(10));
                self.buffer(bytes)
            }
            2 => self.texture(0, 1, 8),
            _ => {
                let (format, shift) = (self.random.below(FORMATS.len()), [0, 0, 1, 1, 2, 3][self.random.below(6)]);
                self.texture(format, shift, 1)
            }
        }
    }

    fn pass(&mut self, reads: &[String], writes: &[(&str, bool)]) {
        let name = format!("p{}", self.passes.len());
        let writes: Vec<Value> =
            writes.iter().map(|(resource, preserve)| json!({"resource": resource, "preserve": preserve})).collect();
        self.passes.push(json!({"name": name, "kind": "compute", "reads": reads, "writes": writes}));
    }

    fn finish(self) -> Declaration {
        let frame = json!({"frame": self.name, "resources": self.resources, "passes": self.passes});
        Declaration::from_frame_json(&frame.to_string()).expect("frames here are sound")
    }
}

/// Each pass reads up to three of the latest results and writes one or two; now and then it adds to an earlier one.
pub(crate) fn mixed(passes: usize, seed: usize) -> Declaration {
    let mut frame = Frame::new(format!("mixed {passes}"), seed);
    let mut results: Vec<String> = Vec::new();
    for at in 0..passes {
        let mut reads: Vec<String> = Vec::new();
        if !results.is_empty() {
            for _ in 0..frame.random.below(4) {
                let back = frame.random.below(results.len().min(16)) + 1;
                reads.push(results[results.len() - back].clone());
            }
        }
        reads.sort();
        reads.dedup();
        let mut written: Vec<String> = (0..=frame.random.below(8) / 6).map(|_| frame.any()).collect();
        let kept = results.last().filter(|last| !reads.contains(last)).filter(|_| at % 7 == 3).cloned();
        let out = frame.random.below(10) == 0 || at + 1 == passes;
        {
            let mut writes: Vec<(&str, bool)> = written.iter().map(|name| (name.as_str(), false)).collect();
            writes.extend(kept.iter().map(|name| (name.as_str(), true)));
            writes.extend(out.then_some(("out", true)));
            frame.pass(&reads, &writes);
        }
        results.append(&mut written);
    }
    frame.finish()
}

/// One after the other, all of one description.
pub(crate) fn chain(passes: usize) -> Declaration {
    let mut frame = Frame::new(format!("chain {passes}"), 0);
    let mut last: Vec<String> = Vec::new();
    for _ in 1..passes {
        let next = frame.texture(0, 0, 1);
        frame.pass(&last, &[(&next, false)]);
        last = vec![next];
    }
    frame.pass(&last, &[("out", false)]);
    frame.finish()
}

/// Producers first, then their consumers: the recorded order is the worst.
pub(crate) fn fan(passes: usize, width: usize) -> Declaration {
    let mut frame = Frame::new(format!("fan {passes}"), 0);
    while frame.passes.len() < passes {
        let many: Vec<String> = (0..width).map(|_| frame.any()).collect();
        for name in &many {
            frame.pass(&[], &[(name, false)]);
        }
        for name in &many {
            frame.pass(std::slice::from_ref(name), &[("out", true)]);
        }
    }
    frame.finish()
}

/// Bloom: down a chain of halves and up again, each level its own texture, on top of a few passes of shading.
pub(crate) fn pyramids(passes: usize, seed: usize) -> Declaration {
    let mut frame = Frame::new(format!("pyramids {passes}"), seed);
    let mut source = frame.texture(0, 0, 1);
    frame.pass(&[], &[(&source, false)]);
    while frame.passes.len() + 14 < passes {
        let format = frame.random.below(4);
        let mut down = vec![source.clone()];
        for level in 1..6 {
            let next = frame.texture(format, level, 1);
            frame.pass(&down[level - 1..level], &[(&next, false)]);
            down.push(next);
        }
        let mut up = down[5].clone();
        for level in (0..5).rev() {
            let next = frame.texture(format, level, 1);
            frame.pass(&[up, down[level].clone()], &[(&next, false)]);
            up = next;
        }
        let shade = frame.any();
        frame.pass(&[up.clone()], &[(&shade, false)]);
        let next = frame.texture(0, 0, 1);
        frame.pass(&[up, shade], &[(&next, false)]);
        source = next;
    }
    frame.pass(&[source], &[("out", false)]);
    frame.finish()
}

/// Tables computed in buffers: counts, sums and lists of several sizes.
pub(crate) fn buffers(passes: usize, seed: usize) -> Declaration {
    let mut frame = Frame::new(format!("buffers {passes}"), seed);
    let mut results: Vec<String> = Vec::new();
    for at in 0..passes {
        let mut reads: Vec<String> = Vec::new();
        for _ in 0..(1 + frame.random.below(3)).min(results.len()) {
            let back = frame.random.below(results.len().min(8)) + 1;
            reads.push(results[results.len() - back].clone());
        }
        reads.sort();
        reads.dedup();
        let bytes = (1 + frame.random.below(100)) << (6 + frame.random.below(14));
        let next = frame.buffer(bytes);
        let last = at + 1 == passes || frame.random.below(12) == 0;
        let writes = [(next.as_str(), false), ("out", true)];
        frame.pass(&reads, &writes[..=usize::from(last)]);
        results.push(next);
    }
    frame.finish()
}

/// What is measured when no file is named.
pub(crate) fn shipped() -> Vec<Declaration> {
    let mut frames: Vec<Declaration> = [100, 256, 1024, 4096, 16384].into_iter().map(|passes| mixed(passes, 1)).collect();
    for passes in [100, 1024, 16384] {
        frames.extend([chain(passes), fan(passes, 16), pyramids(passes, 1), buffers(passes, 1)]);
    }
    frames
}

/// Kinds of random frames, some of each.
pub(crate) fn random() -> Vec<(&'static str, Vec<Declaration>)> {
    vec![
        ("mixed 40…130", (0..300).map(|seed| mixed(40 + seed * 7 % 90, seed)).collect()),
        ("mixed 1000", (0..20).map(|seed| mixed(1000, seed)).collect()),
        ("pyramids 60…200", (0..100).map(|seed| pyramids(60 + seed * 7 % 140, seed)).collect()),
        ("buffers 40…130", (0..200).map(|seed| buffers(40 + seed * 7 % 90, seed)).collect()),
    ]
}
