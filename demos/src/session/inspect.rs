//! What `lightloom graph` and `--layer pass:NAME` ask of a session: times of frames, and the output of one pass.

use std::time::{Duration, Instant};

use lightloom_graph::{Graph, GraphError, Profile, Tap};
use lightloom_passes::CameraUniform;
use lightloom_strategies::{Frame, FrameLayers, Layer, Settings};

use super::{Session, find, no_adapter, no_layer};
use crate::progress::ProgressLine;
use crate::texels::{self, Texels};
use crate::{Error, cancel};

/// Frames whose median time is told, fewer where they take longer than this altogether.
const FRAMES: usize = 5;
const ENOUGH: Duration = Duration::from_secs(4);

/// What a pass wrote.
#[derive(Debug)]
pub(crate) struct Tapped {
    /// Name of the texture.
    pub(crate) resource: String,
    /// What it is, in words.
    pub(crate) description: String,
    /// Its first layer.
    pub(crate) texels: Texels,
    /// Time of all frames (ms).
    pub(crate) wall_ms: f64,
}

impl Session {
    /// Declares frame `index` of a strategy, as [`Session::render`] would run it.
    pub(super) fn declare_frame(
        &mut self,
        strategy: &str,
        settings: &Settings,
        index: u32,
    ) -> Result<(Graph<'static>, FrameLayers), Error> {
        let pipeline = find(&mut self.pipelines, strategy)?;
        let mut graph = Graph::new(strategy);
        let handles = self.scene.declare(&mut graph);
        let info = self.scene.info();
        let camera = CameraUniform::new(&self.camera, settings.size, settings.jitter(index), info.bounds_radius);
        let frame = Frame { scene: &handles, info: &info, camera: &camera, settings, frame_index: index };
        let layers = pipeline.declare_frame(&mut graph, &frame, None)?;
        Ok((graph, layers))
    }

    /// Declares the first frame of a strategy with its image read back.
    pub(crate) fn declare(&mut self, strategy: &str) -> Result<Graph<'static>, Error> {
        let settings = self.settings.clone();
        let (mut graph, layers) = self.declare_frame(strategy, &settings, 0)?;
        for &layer in &settings.layers {
            let image = layers.light(layer).map(|light| &light.mean).or(layers.surface(layer));
            graph.readback_texture(image.ok_or_else(|| no_layer(strategy, layer))?);
        }
        Ok(graph)
    }

    /// Runs the frame that [`Session::declare`] declares a few times, after a warm-up.
    pub(crate) fn measure(&mut self, strategy: &str) -> Result<Profile, Error> {
        let settings = self.settings.clone();
        self.warm_up(strategy, &settings)?;
        let line = ProgressLine::new(strategy);
        let mut profile = Profile::new(&self.adapter);
        let begin = Instant::now();
        while profile.frames.is_empty() || (profile.frames.len() < FRAMES && begin.elapsed() < ENOUGH) {
            let graph = self.declare(strategy)?;
            let done = profile.frames.len() as u64;
            let output = self.executor.as_mut().ok_or_else(no_adapter)?.execute_observed(graph, &mut |progress| {
                let total = progress.total.max(1) as u64;
                line.update(done * total + progress.done as u64, FRAMES as u64 * total, progress.pass);
                cancel::flow()
            })?;
            profile.add(strategy, &output);
        }
        Ok(profile)
    }

    /// Runs the frames of a strategy and brings back what a pass of the last one wrote. `pass` is the name of a pass, with
    /// the name of a binding behind a dot where the pass writes several textures.
    pub(crate) fn tap(&mut self, strategy: &str, samples: u32, pass: &str) -> Result<Tapped, Error> {
        let mut settings = self.settings.clone();
        if strategy == super::REFERENCE_STRATEGY {
            settings.frames = samples;
        }
        // Only what the frames' mean needs is kept alive besides.
        settings.layers = vec![Layer::Final];
        // A wrong name is told before the work.
        let (mut graph, _) = self.declare_frame(strategy, &settings, settings.frames - 1)?;
        find_tap(&mut graph, pass)?;
        self.warm_up(strategy, &settings)?;
        find(&mut self.pipelines, strategy)?.reset();
        let begin = Instant::now();
        let line = ProgressLine::new(strategy);
        for index in 0..settings.frames {
            let (mut graph, _) = self.declare_frame(strategy, &settings, index)?;
            let tap = if index + 1 == settings.frames { Some(find_tap(&mut graph, pass)?) } else { None };
            let output = self.executor.as_mut().ok_or_else(no_adapter)?.execute_observed(graph, &mut |progress| {
                let total = progress.total.max(1) as u64;
                line.update(u64::from(index) * total + progress.done as u64, u64::from(settings.frames) * total, progress.pass);
                cancel::flow()
            })?;
            if let Some(Tap { readback, resource, desc, .. }) = tap {
                let texels = texels::decode(&desc, output.bytes(readback)).map_err(|why| {
                    Error::Usage(format!("--layer pass:{pass}: `{resource}` is {desc}, which cannot be shown: {why}"))
                })?;
                let wall_ms = begin.elapsed().as_secs_f64() * 1e3;
                return Ok(Tapped { resource, description: desc.to_string(), texels, wall_ms });
            }
        }
        Err(Error::Unavailable("no frame was rendered".to_owned()))
    }
}

/// Taps `NAME`, or `NAME.BINDING` where no pass is called so.
fn find_tap(graph: &mut Graph<'_>, name: &str) -> Result<Tap, Error> {
    let wrong = |error: GraphError| Error::Usage(format!("--layer pass:{name}: {error}"));
    let error = match graph.tap(name, None) {
        Ok(tap) => return Ok(tap),
        Err(error) => error,
    };
    match (name.rsplit_once('.'), &error) {
        (Some((pass, binding)), GraphError::UnknownPass { .. }) => match graph.tap(pass, Some(binding)) {
            Ok(tap) => Ok(tap),
            // Without a pass of that name, the whole may as well be a misspelt one.
            Err(GraphError::UnknownPass { .. }) => Err(wrong(error)),
            Err(other) => Err(wrong(other)),
        },
        _ => Err(wrong(error)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightloom_graph::{TextureDesc, wgpu::TextureFormat};

    #[test]
    fn a_name_with_a_dot_is_a_pass_or_a_binding_of_one() {
        let mut graph = Graph::new("f");
        let desc = || TextureDesc::new_2d([2, 2], TextureFormat::R32Float);
        let (mut a, mut b, mut c) = (graph.texture("a", desc()), graph.texture("b", desc()), graph.texture("c", desc()));
        graph.closure("two").write(&mut a).write(&mut b).record(|_| Ok(()));
        graph.closure("x.y").write(&mut c).record(|_| Ok(()));
        assert_eq!(find_tap(&mut graph, "two.b").unwrap().resource, "b");
        assert_eq!(find_tap(&mut graph, "x.y").unwrap().resource, "c");
        for (name, words) in [("two", "name one of"), ("two.z", "does not write `z`"), ("tow", "did you mean `two`")] {
            let error = find_tap(&mut graph, name).unwrap_err();
            assert!(error.to_string().contains(words) && error.exit_status() == 2, "{name}: {error}");
        }
    }
}
