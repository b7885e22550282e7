//! Plans of graphs and of random frames; no device.

use crate::{Amount, fill, kernel};
use lightloom_graph::{
    BufferDesc, Declaration, Graph, Memory, Origin, PassOrder, Plan, PlanOptions, Sharing, TextureDesc, plan, wgpu::TextureFormat,
};
use std::fmt::Write as _;

const PARAMS: Amount = Amount { value: 1.0, count: 8 };

#[test]
fn unused_results_are_culled_and_take_no_memory() {
    let (fill, add) = (fill(), kernel("add", "x + params.value"));
    let mut graph = Graph::new("culling");
    let mut a = graph.buffer("a", BufferDesc::words(8));
    let mut b = graph.buffer("b", BufferDesc::words(8));
    let mut c = graph.buffer("c", BufferDesc::words(8));
    graph.compute(&fill).params(&PARAMS).write("words", &mut a).dispatch_1d(8);
    graph.compute(&add).params(&PARAMS).read("source_words", &a).write("target_words", &mut b).dispatch_1d(8);
    graph.compute(&add).name("dead").params(&PARAMS).read("source_words", &b).write("target_words", &mut c).dispatch_1d(8);
    graph.readback_buffer(&b);
    let plan = graph.plan(&PlanOptions::default()).unwrap();
    assert_eq!(plan.order, [0, 1, 3]);
    assert_eq!(&*plan.culled[0].pass, "dead");
    assert_eq!(plan.culled[0].reason, "writes `c`, which nothing reads");
    assert_eq!(plan.slot_of[2], None, "`c` gets no memory");
    assert_eq!(plan.memory.unshared_bytes, 64);
}

#[test]
fn storage_writes_keep_earlier_contents_and_clears_do_not() {
    let fill = fill();
    let build = |clear: bool| {
        let mut graph = Graph::new("keep");
        let mut a = graph.buffer("a", BufferDesc::words(8));
        graph.compute(&fill).params(&PARAMS).write("words", &mut a).dispatch_1d(4);
        if clear {
            graph.clear_buffer(&mut a);
        } else {
            graph.compute(&fill).name("second").params(&PARAMS).write("words", &mut a).dispatch_1d(2);
        }
        graph.readback_buffer(&a);
        graph.plan(&PlanOptions::default()).unwrap()
    };
    assert_eq!(build(false).order, [0, 1, 2], "the second may write only a part, so the first stays");
    let cleared = build(true);
    assert_eq!(cleared.order, [1, 2]);
    assert_eq!(cleared.culled[0].reason, "writes `a`, which `clear a` overwrites before anything reads it");
}

#[test]
fn roots_are_imports_history_kept_resources_and_side_effects() {
    let fill = fill();
    let mut graph = Graph::new("roots");
    let mut import = graph.import_buffer("import", BufferDesc::words(8), None);
    let mut history = graph.history_buffer("history", BufferDesc::words(8));
    let mut kept = graph.buffer("kept", BufferDesc::words(8));
    let mut dead = graph.buffer("dead", BufferDesc::words(8));
    for buffer in [&mut import, &mut history.current, &mut kept, &mut dead] {
        graph.compute(&fill).params(&PARAMS).write("words", buffer).dispatch_1d(8);
    }
    graph.closure("effect").side_effect().record(|_| Ok(()));
    graph.keep(&kept);
    let plan = graph.plan(&PlanOptions::default()).unwrap();
    assert_eq!(plan.order, [0, 1, 2, 4]);
    let kept = plan.lifetimes[graph.declaration().unwrap().resources.iter().position(|r| &*r.name == "kept").unwrap()].unwrap();
    assert_eq!((kept.first, kept.last), (2, 3), "a kept resource lives to the end");
}

#[test]
fn a_chain_takes_two_arenas_or_objects_of_equal_size() {
    let add = kernel("add", "x + params.value");
    let fill = fill();
    let mut graph = Graph::new("chain");
    let mut now = graph.buffer("0", BufferDesc::words(8));
    graph.compute(&fill).params(&PARAMS).write("words", &mut now).dispatch_1d(8);
    for (i, words) in [8_u64, 8, 9, 8, 8].into_iter().enumerate() {
        let mut next = graph.buffer(&format!("{}", i + 1), BufferDesc::words(words));
        graph.compute(&add).params(&PARAMS).read("source_words", &now).write("target_words", &mut next).dispatch_1d(8);
        now = next;
    }
    graph.readback_buffer(&now);
    let exact = graph.plan(&PlanOptions::default().sharing(Sharing::Exact)).unwrap();
    assert_eq!(exact.slots.len(), 4, "two of 8 words in turn, one of 9, one that is read back: {:?}", exact.slots);
    assert_eq!(exact.memory.allocated_bytes, 3 * 32 + 36);
    let plan = graph.plan(&PlanOptions::default()).unwrap();
    assert_eq!(plan.slots.len(), 2, "every pass reads one arena and writes the other: {:?}", plan.slots);
    assert_eq!(plan.memory.pooled_bytes, 32 + 36, "as much as is live at once");
    assert_eq!(plan.memory.unshared_bytes, 5 * 32 + 36);
    assert_eq!(plan.memory.peak_live_bytes, 32 + 36);
    let off = graph.plan(&PlanOptions::default().sharing(Sharing::Off)).unwrap();
    assert_eq!(off.slots.len(), 6);
}

#[test]
fn declarations_hash_by_structure() {
    let build = |words, value| {
        let mut graph = Graph::new("hash");
        let mut a = graph.buffer("a", BufferDesc::words(words));
        graph.compute(&fill()).params(&Amount { value, count: 8 }).write("words", &mut a).dispatch_1d(words as u32);
        graph.readback_buffer(&a);
        graph.declaration().unwrap()
    };
    assert_eq!(build(8, 1.0), build(8, 2.0), "params are not structure");
    assert_ne!(build(8, 1.0), build(9, 1.0));
}

/// A small generator, so that a failing frame can be found again by its seed.
struct Random(u64);

impl Random {
    fn below(&mut self, n: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % n
    }
}

/// A frame of `passes` passes over about as many resources; reads only what was written.
fn random_frame(seed: u64, passes: usize) -> Declaration {
    let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
    let mut json = String::from(
        "{\"frame\": \"random\", \"resources\": [{\"name\": \"out\", \"kind\": \"buffer\", \"origin\": \"imported\", \"bytes\": 4}",
    );
    for i in 0..passes {
        let _ = write!(
            json,
            ", {{\"name\": \"r{i}\", \"kind\": \"buffer\", \"origin\": \"transient\", \"bytes\": {}}}",
            (random.below(4) + 1) * 1000
        );
    }
    json.push_str("], \"passes\": [");
    let mut written: Vec<u64> = Vec::new();
    for i in 0..passes {
        let recent = |random: &mut Random, written: &[u64]| {
            written[written.len() - 1 - random.below(written.len().min(12) as u64) as usize]
        };
        let reads: Vec<u64> =
            if written.is_empty() { Vec::new() } else { (0..random.below(3)).map(|_| recent(&mut random, &written)).collect() };
        let (target, preserve) = if written.is_empty() || random.below(4) > 0 {
            (i as u64, false)
        } else {
            (recent(&mut random, &written), random.below(2) == 0)
        };
        written.push(target);
        let reads: Vec<String> = reads.iter().map(|r| format!("\"r{r}\"")).collect();
        let out = if random.below(8) == 0 || i + 1 == passes { ", {\"resource\": \"out\", \"preserve\": true}" } else { "" };
        let comma = if i == 0 { "" } else { ", " };
        let _ = write!(
            json,
            "{comma}{{\"name\": \"p{i}\", \"kind\": \"compute\", \"reads\": [{}], \"writes\": [{{\"resource\": \"r{target}\", \"preserve\": {preserve}}}{out}]}}",
            reads.join(", ")
        );
    }
    json.push_str("]}");
    Declaration::from_frame_json(&json).unwrap()
}

/// What must hold of every plan.
fn check(declaration: &Declaration, plan: &Plan) {
    let Memory { unshared_bytes, ordered_peak_live_bytes: peak, pooled_bytes, allocated_bytes, .. } = plan.memory;
    assert!(peak <= allocated_bytes, "{:?}", plan.memory);
    assert!(pooled_bytes <= unshared_bytes, "{:?}", plan.memory);
    assert_eq!(plan.order.len() + plan.culled.len(), declaration.passes.len(), "a pass runs or is culled");
    let transient: Vec<usize> = (0..declaration.resources.len())
        .filter(|&r| declaration.resources[r].origin == Origin::Transient && plan.lifetimes[r].is_some())
        .collect();
    for (n, &a) in transient.iter().enumerate() {
        let (life, offset) = (plan.lifetimes[a].unwrap(), plan.offsets[a].unwrap());
        let slot = &plan.slots[plan.slot_of[a].unwrap()];
        assert!(offset + declaration.resources[a].bytes <= slot.bytes, "inside its slot");
        for &b in &transient[..n] {
            let (other, other_offset) = (plan.lifetimes[b].unwrap(), plan.offsets[b].unwrap());
            if life.first <= other.last && other.first <= life.last {
                let apart = offset + declaration.resources[a].bytes <= other_offset
                    || other_offset + declaration.resources[b].bytes <= offset;
                assert!(apart || plan.slot_of[a] != plan.slot_of[b], "r{a} and r{b} overlap");
            }
        }
    }
    // Every pass that runs and reads something has its last writer run before it.
    for (position, &pass) in plan.order.iter().enumerate() {
        for access in declaration.passes[pass].accesses.iter().filter(|access| access.read) {
            let writer = (0..pass)
                .rev()
                .find(|&p| declaration.passes[p].accesses.iter().any(|a| a.resource == access.resource && a.writes()));
            if let Some(writer) = writer {
                assert!(plan.order[..position].contains(&writer), "p{pass} reads what the culled p{writer} wrote");
            }
        }
    }
}

#[test]
fn random_frames_are_planned_soundly() {
    for seed in 0..200 {
        let declaration = random_frame(seed, 5 + seed as usize % 60);
        for sharing in [Sharing::Off, Sharing::Exact, Sharing::Merged, Sharing::Placed] {
            let plan = plan(&declaration, &PlanOptions::default().sharing(sharing))
                .unwrap_or_else(|error| panic!("seed {seed}: {error}"));
            check(&declaration, &plan);
            let options = PlanOptions::default().sharing(sharing).order(PassOrder::Recorded);
            let recorded = lightloom_graph::plan(&declaration, &options).unwrap();
            check(&declaration, &recorded);
            assert!(recorded.order.is_sorted(), "recorded order respects every dependency and breaks every tie");
            assert!(plan.memory.ordered_peak_live_bytes <= recorded.memory.ordered_peak_live_bytes, "seed {seed}");
            let again = lightloom_graph::plan(&declaration, &PlanOptions::default().sharing(sharing)).unwrap();
            assert_eq!(plan, again, "planning is deterministic");
        }
    }
}

#[test]
fn a_hundred_thousand_passes_are_planned() {
    let declaration = random_frame(1, 100_000);
    let started = std::time::Instant::now();
    let plan = plan(&declaration, &PlanOptions::default()).unwrap();
    let seconds = started.elapsed().as_secs_f64();
    println!("{} of 100000 passes run; planned in {seconds:.2} s", plan.order.len());
    assert!(plan.order.len() > 1000, "the frame is not trivial");
    // Linear planning takes a fraction of a second; a quadratic phase would take many minutes.
    assert!(seconds < 20.0, "{seconds} s");
}

#[test]
fn a_long_chain_of_keeps_does_not_recurse() {
    let mut graph = Graph::new("deep");
    let mut a = graph.texture("a", TextureDesc::new_2d([1, 1], TextureFormat::R32Float));
    let mut b = graph.texture("b", TextureDesc::new_2d([1, 1], TextureFormat::R32Float));
    graph.closure("first").write(&mut a).record(|_| Ok(()));
    for _ in 0..20_000 {
        graph.closure("step").read(&a).write(&mut b).record(|_| Ok(()));
        std::mem::swap(&mut a, &mut b);
    }
    graph.readback_texture(&a);
    assert_eq!(graph.plan(&PlanOptions::default()).unwrap().order.len(), 20_002);
}
