//! An animated scene in a session: posed on the CPU, followed by the hierarchy, then by the GPU.

use std::time::Instant;

use lightloom_passes::scene::{Bvh, Followed, Scene};

use super::Session;
use crate::Error;

/// What a session keeps of a scene that moves.
#[derive(Debug)]
pub(super) struct Motion {
    pub(super) scene: Scene,
    pub(super) bvh: Bvh,
    /// As on the command line.
    pub(super) camera: Option<String>,
}

/// What a pose cost, in wall-clock time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PoseCost {
    /// Moving triangles, lights and cameras (ms).
    pub(crate) pose_ms: f64,
    /// How the hierarchy followed.
    pub(crate) followed: Followed,
    /// Refitting it and, if need be, building it (ms).
    pub(crate) hierarchy_ms: f64,
    /// Handing it all to the queue (ms).
    pub(crate) upload_ms: f64,
}

impl Session {
    /// Moves scene and camera to `time` (s).
    pub(crate) fn pose(&mut self, time: f32) -> Result<PoseCost, Error> {
        let Some(Motion { scene, bvh, camera }) = &mut self.motion else {
            return Err(Error::Usage("the scene has no animation".to_owned()));
        };
        let start = Instant::now();
        scene.pose(time)?;
        let posed = Instant::now();
        let followed = bvh.follow(&scene.name, &scene.triangles)?;
        let hierarchy = Instant::now();
        self.scene.update(scene, bvh)?;
        let uploaded = Instant::now();
        // Without a camera in the file the scene was framed as a whole; that picture holds still.
        if !scene.cameras.is_empty() {
            self.camera = scene.camera(camera.as_deref())?;
        }
        let ms = |from: Instant, to: Instant| (to - from).as_secs_f64() * 1e3;
        Ok(PoseCost {
            pose_ms: ms(start, posed),
            followed,
            hierarchy_ms: ms(posed, hierarchy),
            upload_ms: ms(hierarchy, uploaded),
        })
    }
}
