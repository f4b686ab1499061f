"""First contacts of spheres."""

from __future__ import annotations

import numpy as np
import palpate
import pytest


def sphere(points: int) -> tuple[np.ndarray, np.ndarray]:
    """A unit sphere of triangles."""
    polar, azimuth = np.meshgrid(np.linspace(0, np.pi, points), np.linspace(0, 2 * np.pi, 2 * points), indexing="ij")
    corners = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=-1)
    index = np.arange(corners.shape[0] * corners.shape[1]).reshape(corners.shape[:2])
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    return corners.reshape(-1, 3), np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)


def test_a_sphere_is_met_where_geometry_says() -> None:
    surface = palpate.Surface(*sphere(60))
    generator = np.random.default_rng(1)
    directions = generator.normal(size=(1000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    across = np.cross(directions, generator.normal(size=(1000, 3)))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    offset = generator.uniform(0, 1.5, size=(1000, 1))
    times = surface.first_contact(-5 * directions + offset * across, directions, 0.25)
    expected = 5 - np.sqrt(np.maximum(1.25**2 - offset[:, 0] ** 2, 0))
    sure = np.abs(offset[:, 0] - 1.25) > 0.01
    assert np.array_equal(np.isnan(times)[sure], (offset[:, 0] > 1.25)[sure])
    near = sure & (offset[:, 0] < 1.2)
    np.testing.assert_allclose(times[near], expected[near], atol=0.01)
    # One by one, the same to the last bit.
    alone = [surface.first_contact(-5 * d[None] + o * a[None], d[None], 0.25)[0] for d, o, a in zip(directions, offset, across)]
    np.testing.assert_array_equal(alone, times)


def test_one_direction_serves_all_and_wrong_shapes_are_refused() -> None:
    surface = palpate.Surface([[-1, -1, 0], [1, -1, 0], [1, 1, 0]], [[0, 1, 2]])
    origins = np.tile([0.5, -0.5, 2.0], (100, 1))
    np.testing.assert_array_equal(surface.first_contact(origins, [[0, 0, -1]], 0.5), np.full(100, 1.5))
    assert surface.bounds == ([-1, -1, 0], [1, 1, 0]) and surface.triangles == 1
    assert surface.first_contact(np.empty((0, 3)), [[0, 0, -1]], 0.5).shape == (0,)
    for origins_, directions, radius in [
        ([[0, 0]], [[0, 0, -1]], 0.5),
        ([[0, 0, 1]], [[0, 0, -1]] * 2, 0.5),
        ([[0, 0, 1]], [[0, 0, -1]], -1.0),
    ]:
        with pytest.raises(ValueError):
            surface.first_contact(origins_, directions, radius)
    with pytest.raises(palpate.InputError, match="vertex 7"):
        palpate.Surface([[0, 0, 0]], [[0, 0, 7]])
