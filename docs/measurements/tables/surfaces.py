"""Prints how far surfaces of scans are from the true meshes, beside those of Open3D (screened Poisson reconstruction).

    pip install open3d==0.20.0 numpy
    python3.11 docs/measurements/tables/scans.py target/release/palpate OBJECTS DIRECTORY
    python3.11 docs/measurements/tables/surfaces.py target/release/palpate OBJECTS DIRECTORY

The second command writes the scans to DIRECTORY. Both make surfaces of the same points; Open3D gets normals from 30 neighbors,
turned toward the camera that saw the point. Distances are measured by Open3D, in mm, at 100,000 points drawn from each surface.
Another sampling of the same meshes: NOISE, ALONG, SEED of scans.py. Some two minutes on two cores.
"""

import subprocess
import sys
import time
from pathlib import Path

import numpy
import open3d

PALPATE, OBJECTS, PLACE = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
SIZE, SAMPLES, DEPTHS = 100, 100_000, [5, 6, 7, 8]


def truth(path):
    """A mesh as scans.py scales it: in the middle, the longest side 100 mm."""
    mesh = open3d.io.read_triangle_mesh(str(path))
    low, high = mesh.get_min_bound(), mesh.get_max_bound()
    mesh.translate(-(low + high) / 2)
    return mesh.scale(SIZE / max(high - low), center=[0, 0, 0])


def distances(of, to):
    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles(open3d.t.geometry.TriangleMesh.from_legacy(to))
    points = numpy.asarray(of.sample_points_uniformly(SAMPLES).points, dtype=numpy.float32)
    return scene.compute_distance(open3d.core.Tensor(points)).numpy()


def palpates(scan):
    start = time.time()
    directory = PLACE / "surfaces"
    subprocess.run([PALPATE, "data", "objects", scan, "-o", directory, "--quiet"], check=True, stdout=subprocess.DEVNULL)
    return open3d.io.read_triangle_mesh(str(directory / f"{scan.stem}.obj")), time.time() - start


def open3ds(scan, depth):
    rows = numpy.array([line.split() for line in scan.read_text().split("end_header\n")[1].splitlines()], dtype=float)
    start = time.time()
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(rows[:, :3]))
    cloud.estimate_normals(open3d.geometry.KDTreeSearchParamKNN(30))
    normals = numpy.asarray(cloud.normals)
    outward = numpy.sign(numpy.sum(normals * (rows[:, 3:] - rows[:, :3]), axis=1, keepdims=True))
    cloud.normals = open3d.utility.Vector3dVector(normals * outward)
    mesh, _ = open3d.geometry.TriangleMesh.create_from_point_cloud_poisson(cloud, depth=depth)
    return mesh, time.time() - start


open3d.utility.random.seed(1)
methods = {"Palpate": palpates} | {f"Open3D, depth {depth}": lambda scan, depth=depth: open3ds(scan, depth) for depth in DEPTHS}
names = sorted(path.stem for path in OBJECTS.glob("*.obj"))
found = {method: [] for method in methods}
print("| object | method | surface to mesh: mean, 95 % | mesh to surface: mean, 95 % | triangles | each edge of two triangles | seconds |")
print("|---|---|---|---|---|---|---|")
for name in names:
    mesh = truth(OBJECTS / f"{name}.obj")
    for method, make in methods.items():
        surface, seconds = make(PLACE / "scans" / f"{name}.ply")
        there, back = distances(surface, mesh), distances(mesh, surface)
        values = [there.mean(), numpy.quantile(there, 0.95), back.mean(), numpy.quantile(back, 0.95), seconds]
        found[method].append(values)
        closed = "yes" if surface.is_edge_manifold(allow_boundary_edges=False) else "no"
        print(f"| {name} | {method} | {values[0]:.2f}, {values[1]:.2f} | {values[2]:.2f}, {values[3]:.2f} "
              f"| {len(surface.triangles):,} | {closed} | {seconds:.1f} |", flush=True)
ours = numpy.mean(found["Palpate"], axis=0)
print("\n| mean of all objects | surface to mesh: mean, 95 % | mesh to surface: mean, 95 % | seconds | times Palpate's mean distances |")
print("|---|---|---|---|---|")
for method, values in found.items():
    mean = numpy.mean(values, axis=0)
    print(f"| {method} | {mean[0]:.2f}, {mean[1]:.2f} | {mean[2]:.2f}, {mean[3]:.2f} | {mean[4]:.1f} "
          f"| {mean[0] / ours[0]:.2f}, {mean[2] / ours[2]:.2f} |")
