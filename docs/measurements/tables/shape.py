"""Other interpolations of the samples that tests/src/bin/shape.rs wrote: shape.py DIRECTORY, called by shape.sh."""

import sys
from pathlib import Path

import numpy as np
from scipy.interpolate import LinearNDInterpolator, RBFInterpolator


def linear(places, heights, cells):
    """Linear interpolation in Delaunay triangles; the table beyond them."""
    return np.nan_to_num(LinearNDInterpolator(places, heights)(cells))


def plate(places, heights, cells):
    """The mean of a Gaussian process with a thin-plate kernel and noise."""
    return RBFInterpolator(places, heights, kernel="thin_plate_spline", smoothing=1)(cells)


def main():
    """Prints a row for each kind of interpolation."""
    directory, sums = Path(sys.argv[1]), {}
    for truth in sorted(directory.glob("* truth.txt")):
        half_x, half_y, *heights = np.loadtxt(truth)
        true = np.array(heights)
        grid = np.meshgrid(np.arange(-half_x, half_x + 1), np.arange(-half_y, half_y + 1))
        cells = np.stack([axis.ravel() for axis in grid], axis=1)
        for path in sorted(directory.glob(f"{truth.name.split(' ')[0]} * *.txt")):
            _, aims, after = path.stem.split(" ")
            samples = np.loadtxt(path)
            samples = samples[samples[:, 3] > 0]
            _, first = np.unique(samples[:, :2].round(6), axis=0, return_index=True)
            places, met = samples[first, :2], samples[first, 2]
            for name, guess in (("linear", linear), ("thin plate", plate)):
                guessed = guess(places, met, cells)
                error = np.abs(guessed - true)[true > 0.5].mean()
                union = ((guessed > 1) & (true > 1)).sum() / ((guessed > 1) | (true > 1)).sum()
                sums.setdefault((name, aims, int(after)), []).append((error, union))
    print("\n| interpolation | aims | approaches | error, mm | IoU |\n|---|---|---|---|---|")
    for (name, aims, after), found in sorted(sums.items()):
        error, union = np.mean(found, axis=0)
        print(f"| {name} | {aims} | {after} | {error:.2f} | {union:.3f} |")


if __name__ == "__main__":
    main()
