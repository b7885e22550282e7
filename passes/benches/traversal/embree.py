"""Traces rays with Embree, for the benchmark beside it: `python3 embree.py TRIANGLES`.

TRIANGLES holds nine f32 per triangle. Each line of the input names a file of rays, eight f32 each (origin, length, direction,
padding); lengths are taken as unlimited. Writes the index of the triangle that each ray met (i32, -1: none) to that file with
`.hits` added, and prints the milliseconds that tracing took. The scene is built before the first line is read.

`embreex` traces one ray after the other (`rtcIntersect1`) and lets go of Python's lock meanwhile, so that a thread per core
traces in parallel.
"""

import os
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import numpy
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

scene = EmbreeScene()
mesh = TriangleMesh(scene, numpy.fromfile(sys.argv[1], numpy.float32).reshape(-1, 3, 3))
threads = len(os.sched_getaffinity(0))
nowhere = numpy.zeros((1, 3), numpy.float32)
scene.run(nowhere, nowhere + 1)

with ThreadPoolExecutor(threads) as pool:
    for line in sys.stdin:
        path = line.strip()
        parts = numpy.array_split(numpy.fromfile(path, numpy.float32).reshape(-1, 8), threads)
        origins = [numpy.ascontiguousarray(part[:, 0:3]) for part in parts]
        directions = [numpy.ascontiguousarray(part[:, 4:7]) for part in parts]
        start = time.perf_counter()
        hits = list(pool.map(scene.run, origins, directions))
        milliseconds = 1e3 * (time.perf_counter() - start)
        numpy.concatenate(hits).astype(numpy.int32).tofile(path + ".hits")
        print(milliseconds, flush=True)
