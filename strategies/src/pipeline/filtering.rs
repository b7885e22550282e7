//! The filters' place in a frame.

use super::{Frame, Layer};
use crate::{Estimate, StrategyError};
use lightloom_graph::{Graph, Handle, Texture, WgslSources};
use lightloom_passes::{CameraUniform, Filter, FilterFrame, FilterInputs, GBuffer, ReflectIrradiance};

/// The filters, and the frame that they remember.
#[derive(Debug, Default)]
pub(super) struct Filtering {
    /// Parsed when first asked for.
    passes: Option<(Filter, ReflectIrradiance)>,
    /// The eye of the frame before; `None`: nothing is remembered.
    previous: Option<CameraUniform>,
}

impl Filtering {
    /// The next frame finds no history.
    pub(super) fn forget(&mut self) {
        self.previous = None;
    }

    /// Filters what the frame shows of `estimate`, in place, and `occlusion`.
    pub(super) fn add(
        &mut self,
        graph: &mut Graph<'_>,
        sources: &WgslSources,
        frame: &Frame<'_>,
        (gbuffer, visibility): (&GBuffer, Option<&Handle<Texture>>),
        estimate: &mut Estimate,
        occlusion: &mut Option<Handle<Texture>>,
    ) -> Result<(), StrategyError> {
        let Frame { scene, info, camera, settings, .. } = *frame;
        let shows = |layer| settings.layers.contains(&layer);
        let indirect = shows(Layer::Final) || shows(Layer::Indirect);
        let caustic = shows(Layer::Caustic) && estimate.caustic.is_some();
        let previous = self.previous.take();
        // What writes history always runs: it is declared only where the frame shows the result.
        let Some(constants) = settings.filter.filter(|_| indirect || caustic) else { return Ok(()) };
        let (filter, reflect) = match &mut self.passes {
            Some(passes) => passes,
            none => none.insert((Filter::new(sources)?, ReflectIrradiance::new(sources)?)),
        };
        let inputs = FilterInputs { scene, info, camera, previous: previous.as_ref(), gbuffer, visibility };
        let common: FilterFrame<'_> = filter.begin(graph, constants, &inputs);
        if indirect {
            estimate.indirect = match &estimate.irradiance {
                Some(light) => {
                    let light = filter.irradiance(graph, &common, "indirect", light);
                    reflect.add(graph, "filtered", scene, camera, gbuffer, &light)
                }
                None => filter.radiance(graph, &common, "indirect", &estimate.indirect),
            };
        }
        if let Some(image) = estimate.caustic.as_mut().filter(|_| caustic) {
            *image = filter.radiance(graph, &common, "caustic", image);
        }
        if let Some(image) = occlusion.as_mut().filter(|_| shows(Layer::Final)) {
            *image = filter.image(graph, &common, "ambient_occlusion", image);
        }
        self.previous = Some(*camera);
        Ok(())
    }
}
